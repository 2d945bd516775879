#pragma once

#include <optional>
#include <string>

#include "model/schema.h"
#include "model/section.h"

namespace mantle::model {

/// The effect `viscous_drag`, of a slender arm so small or slow that viscosity prevails: resistive
/// force theory (Gray and Hancock, J. Exp. Biol. 32, 1955). Per length of an arm
///
///   f = -(c_t t t^T + c_n (1 - t t^T)) v   with v the velocity through the water, t along the arm,
///
/// and on the root -(c_v v, c_w omega). A slender cylinder of length L and radius a in water of
/// viscosity mu has c_t = 2 pi mu / (ln(2 L / a) - 1/2), c_n about twice that; a sphere of radius b
/// c_v = 6 pi mu b, c_w = 8 pi mu b^3.
struct ViscousDrag {
  double tangential_pa_s{0}, normal_pa_s{0};           ///< c_t, c_n [N s/m^2]
  double root_linear_n_s_m{0}, root_angular_n_m_s{0};  ///< c_v, c_w

  struct SectionLoad;
  struct RootLoad;
  static constexpr const char* kName = "viscous_drag";
  static constexpr bool kOnVelocity = true;
  static constexpr const char* kWithoutPotential = nullptr;

  static void Read(schema::Visitor& v, std::optional<ViscousDrag>* effect) {
    using schema::kNonNegative;
    using schema::Quantity;
    ViscousDrag d;
    const auto read = [&](schema::Visitor& t) {
      t.Number({.name = "tangential",
                .meaning = "per length and speed along an arm",
                .also = "some coefficient > 0"},
               Quantity::kViscosity, kNonNegative, &d.tangential_pa_s);
      t.Number({"normal", "per length and speed across it"}, Quantity::kViscosity, kNonNegative,
               &d.normal_pa_s);
      t.Number({"root_linear", "of the root, per speed"}, Quantity::kDamping, kNonNegative,
               &d.root_linear_n_s_m);
      t.Number({.name = "root_angular", .meaning = "per angular speed", .unit = "N m s"},
               Quantity::kNumber, kNonNegative, &d.root_angular_n_m_s);
      t.Demand(t.describing() || d.tangential_pa_s > 0 || d.normal_pa_s > 0 ||
                   d.root_linear_n_s_m > 0 || d.root_angular_n_m_s > 0,
               "tangential", "0, as all others: one of them must be > 0");
    };
    if (v.Table(schema::Optional({kName, "linear: small or slow bodies"}), read)) *effect = d;
  }
  static void Check(schema::Visitor& v, const ViscousDrag& d, const Bodies& bodies) {
    v.DemandAt(!bodies.arms.empty() || (d.tangential_pa_s == 0 && d.normal_pa_s == 0),
               "effects.viscous_drag", "has coefficients of arms, but the scene has no arm");
  }
};

/// On the sections of every arm.
struct ViscousDrag::SectionLoad {
  Vector3 coefficients_pa_s;  ///< along the section's axes; x is along the arm
  int place{-1};              ///< see PowerNames

  static std::optional<SectionLoad> From(const ViscousDrag& d, const Arm&, const Water&) {
    if (d.tangential_pa_s == 0 && d.normal_pa_s == 0) return std::nullopt;
    return SectionLoad{{d.tangential_pa_s, d.normal_pa_s, d.normal_pa_s}};
  }
  static constexpr bool kField = false;
  bool IsNothing() const { return false; }
  bool NeedsRotation() const { return false; }
  void Scale(const Mismatch& m) { coefficients_pa_s *= m.drag; }
  void Name(const std::string& arm, PowerNames* names) {
    place = names->Place("viscous_drag." + arm);
  }
  Vector6 Density(const SectionGeometry&, const SectionMotion& m) const {
    Vector6 w = Vector6::Zero();
    w.tail<3>() = -coefficients_pa_s.cwiseProduct(m.twist.tail<3>());
    return w;
  }
  void AddTangent(const SectionGeometry&, const SectionMotion&, LoadTangent* t) const {
    t->force_by_velocity.diagonal() -= coefficients_pa_s;
  }
  void AddPower(const SectionGeometry& s, const SectionMotion& m, const Vector6& working_twist,
                double scale, double* power_w) const {
    power_w[place] += scale * Density(s, m).dot(working_twist);
  }
};

/// On the root.
struct ViscousDrag::RootLoad {
  double linear_n_s_m, angular_n_m_s;
  int place{-1};  ///< see PowerNames

  static std::optional<RootLoad> From(const ViscousDrag& d, const Bodies&) {
    if (d.root_linear_n_s_m == 0 && d.root_angular_n_m_s == 0) return std::nullopt;
    return RootLoad{d.root_linear_n_s_m, d.root_angular_n_m_s};
  }
  static constexpr bool kField = false;
  void Scale(const Mismatch& m) {
    linear_n_s_m *= m.drag;
    angular_n_m_s *= m.drag;
  }
  void Name(PowerNames* names) { place = names->Place("viscous_drag.root"); }
  Vector6 Wrench(const SectionMotion& root) const {
    Vector6 w;
    w << -angular_n_m_s * root.twist.head<3>(), -linear_n_s_m * root.twist.tail<3>();
    return w;
  }
  void AddTangent(const SectionMotion&, double scale, RootTangent* t) const {
    t->by_twist.diagonal().head<3>().array() -= scale * angular_n_m_s;
    t->by_twist.diagonal().tail<3>().array() -= scale * linear_n_s_m;
  }
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const {
    power_w[place] += scale * Wrench(root).dot(working_twist);
  }
};

}  // namespace mantle::model
