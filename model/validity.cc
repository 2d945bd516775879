#include "model/validity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/arm_section.h"

namespace mantle::model {
namespace {

constexpr int kMostLobes = 200;

std::string At(const std::optional<double>& time_s) {
  return time_s ? fmt::format(", t = {:.4g} s", *time_s) : "";
}

}  // namespace

LargestStrain FindLargestStrain(const Plant& plant, const PlantWork& work) {
  LargestStrain largest;
  const auto consider = [&](double value, const std::string& body, double x_m) {
    if (value > largest.value || largest.body.empty()) largest = {value, body, x_m, {}};
  };
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    const Rod& rod = plant.rods[a];
    const Arm& arm = plant.robot.arms[a];
    for (int i = 0; i < rod.element_count(); ++i) {
      const RodElement& e = rod.elements[i];
      const Vector6 strain = work.rod[a][i].Strain(e) - e.reference_strain;
      const double x = 0.5 * (rod.x_m[i] + rod.x_m[i + 1]);
      const bool nominal = arm.pieces.empty() ? arm.stiffness.has_value()
                                              : PieceAt(arm.pieces, x).piece.stiffness.has_value();
      const double radius =
          nominal ? 0.0 : 0.5 * (rod.nodes[i].section.radius_m + rod.nodes[i + 1].section.radius_m);
      const double stretch = std::abs(strain(3)) + radius * strain.segment<2>(1).norm();
      const double shear =
          strain.tail<2>().cwiseProduct(e.shear_share).norm() + radius * std::abs(strain(0));
      consider(std::max(stretch, shear), rod.name, x);
    }
  }
  if (!plant.shell) return largest;
  const Shell& shell = *plant.shell;
  const double h = shell.material.half_thickness_m;
  for (int i = 0; i < shell.element_count(); ++i) {
    const Vector5& e = work.shell[i].strain;
    const double value = std::max(
        {std::abs(e(0)) + h * std::abs(e(2)), std::abs(e(1)) + h * std::abs(e(3)), std::abs(e(4))});
    consider(value, shell.name, 0.5 * (shell.nodes[i].x_m + shell.nodes[i + 1].x_m));
  }
  return largest;
}

LobedBuckling FindLobedBuckling(const Shell& shell) {
  double radius = 0;
  for (const Vector3& q : shell.reference) radius = std::max(radius, q(0));
  const ShellMaterial& m = shell.material;
  const double t = 2.0 * m.half_thickness_m;
  const double stiffening = 1.0 - m.poisson * m.poisson;
  const double slenderness = t / radius;
  LobedBuckling out;
  out.free_pa = m.young_pa * std::pow(slenderness, 3) / (4.0 * stiffening);
  out.held_pa = std::numeric_limits<double>::infinity();
  const double alpha2 = std::pow(std::numbers::pi * radius / shell.nodes.back().x_m, 2);
  for (int n = 2; n <= kMostLobes; ++n) {
    const double n2 = static_cast<double>(n) * n;
    const double membrane = std::pow(alpha2 / (n2 + alpha2), 2);
    const double bending = std::pow(slenderness * (n2 + alpha2 - 1.0), 2) / (12.0 * stiffening);
    const double p = m.young_pa * slenderness / (n2 - 1.0) * (membrane + bending);
    if (p < out.held_pa) {
      out.held_pa = p;
      out.held_lobes = n;
    }
  }
  return out;
}

double InwardPressure(const Plant& plant, const PlantInputs& inputs,
                      const std::vector<double>& cable_tension_n) {
  if (!plant.shell) return 0.0;
  const Shell& shell = *plant.shell;
  double largest = 0;
  for (int j = 0; j < shell.node_count(); ++j) {
    const double area = shell.nodes[j].area_m2;
    if (!(area > 0.0)) continue;
    double force = 0;
    for (std::size_t k = 0; k < shell.strips.size(); ++k) {
      force += inputs.strips_pa[k] * shell.strips[k].strip.area_m2[j];
    }
    for (std::size_t k = 0; k < shell.spokes.size(); ++k) {
      const ShellSpokes& s = shell.spokes[k];
      const double tension = cable_tension_n[plant.SpokeIndex(static_cast<int>(k))];
      force += tension * s.spokes * s.strip.area_m2[j] / s.strip.total_m2;
    }
    largest = std::max(largest, force / area - inputs.normal_pressure_pa);
  }
  return largest;
}

void ValidityRecord::Add(const Plant& plant, const PlantInputs& inputs, const PlantWork& work,
                         double time_s) {
  const LargestStrain now = FindLargestStrain(plant, work);
  if (!now.body.empty() && now.value > strain_) {
    strain_ = now.value;
    x_m_ = now.x_m;
    strain_time_s_ = time_s;
    body_ = static_cast<double>(plant.rods.size());  // the mantle
    for (std::size_t a = 0; a < plant.rods.size(); ++a) {
      if (plant.rods[a].name == now.body) body_ = static_cast<double>(a);
    }
  }
  const double inward = InwardPressure(plant, inputs, work.cable_tension_n);
  if (inward > working_pa_) {
    working_pa_ = inward;
    working_time_s_ = time_s;
  }
}

LargestStrain ValidityRecord::strain(const Plant& plant) const {
  if (body_ < 0.0) return {};
  const auto body = static_cast<std::size_t>(body_);
  return {strain_, body < plant.rods.size() ? plant.rods[body].name : plant.shell->name, x_m_,
          strain_time_s_};
}

std::optional<LobedBucklingMargin> ValidityRecord::lobed_buckling(const Plant& plant) const {
  if (!plant.shell) return std::nullopt;
  return LobedBucklingMargin{FindLobedBuckling(*plant.shell), working_pa_, working_time_s_};
}

std::vector<std::string> StrainWarnings(const LargestStrain& strain) {
  if (!(strain.value > kLargeStrain)) return {};
  return {
      fmt::format("{}: strain {:.3g} at X = {:.4g} m{}, beyond {} the linear material law is a "
                  "guess: lower the loads or take a secant modulus",
                  strain.body, strain.value, strain.x_m, At(strain.time_s), kLargeStrain)};
}

std::vector<std::string> LobedBucklingWarnings(const LobedBucklingMargin& margin) {
  const LobedBuckling& lobes = margin.lobes;
  if (!(margin.working_pa > lobes.free_pa)) return {};
  return {fmt::format(
      "mantle: {:.4g} Pa inward{} where a tube of its size goes into lobes at {:.3g} Pa (ends "
      "free) to {:.3g} Pa (ends held round, {} lobes), which the axisymmetric model cannot show: "
      "ribs or a thicker wall must hold it round",
      margin.working_pa, At(margin.time_s), lobes.free_pa, lobes.held_pa, lobes.held_lobes)};
}

}  // namespace mantle::model
