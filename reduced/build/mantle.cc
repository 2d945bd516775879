#include "reduced/build/mantle.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "reduced/build/cubature.h"
#include "reduced/build/mantle_basis.h"

namespace mantle::reduced {
namespace {

using model::Plant;
using model::Shell;

constexpr int kTrainingShapes = 24;
constexpr double kTrainingSpread = 0.25;  // of the coordinates' scale, around the static path
constexpr unsigned kSeed = 11;

// Nodal values of shape column i: component 0 r, 1 z, 2 theta.
double ShapeAt(const ReducedMantle& m, int node, int component, int i) {
  return m.basis.shapes(3 * node + component, i);
}

VectorX Weighted(const ReducedMantle& m, int component, const std::vector<double>& weight) {
  VectorX sum = VectorX::Zero(m.size);
  for (std::size_t j = 0; j < weight.size(); ++j) {
    for (int i = 0; i < m.size; ++i) {
      sum(i) += weight[j] * ShapeAt(m, static_cast<int>(j), component, i);
    }
  }
  return sum;
}

std::vector<Vector3> Lift(const ReducedMantle& m, const VectorX& s) {
  std::vector<Vector3> q = m.reference;
  for (std::size_t j = 0; j < q.size(); ++j) {
    q[j] += m.basis.shapes.middleRows<3>(3 * static_cast<int>(j)) * s;
  }
  return q;
}

std::vector<CubatureElement> AllElements(const ReducedMantle& m, const Shell& shell) {
  std::vector<CubatureElement> out;
  for (int e = 0; e < shell.element_count(); ++e) {
    CubatureElement c;
    c.index = e;
    c.element = shell.elements[e];
    model::ShellElementState state;
    const Vector3 still = Vector3::Zero();
    EvaluateShellElement(c.element, shell.material, m.reference[e], m.reference[e + 1], still,
                         still, &state);
    c.rest = state.y;
    c.rows.setZero(5, m.size);
    for (int i = 0; i < m.size; ++i) {
      // y is linear in the nodes: its rate for nodal rates that are the shape
      EvaluateShellElement(c.element, shell.material, m.reference[e], m.reference[e + 1],
                           m.basis.shapes.block<3, 1>(3 * e, i),
                           m.basis.shapes.block<3, 1>(3 * e + 3, i), &state);
      c.rows.col(i) = state.y_dot;
    }
    out.push_back(std::move(c));
  }
  return out;
}

// Contributions of every element to force, stiffness and damping at training shapes; each kind is
// scaled to its sum's size, so that small deflections weigh as much as large ones.
Eigen::MatrixXd TrainingRows(const ReducedMantle& m, const std::vector<CubatureElement>& all) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const int k = m.size, rows = k + 2 * k * k;
  Eigen::MatrixXd g(kTrainingShapes * rows, all.size());
  for (int t = 0; t < kTrainingShapes; ++t) {
    VectorX s = VectorX::Zero(k);
    if (!m.basis.equilibria.empty()) {
      const double place = uniform(random) * 0.5 + 0.5;
      const double at = place * static_cast<double>(m.basis.equilibria.size());
      const auto i = std::min(static_cast<std::size_t>(at), m.basis.equilibria.size() - 1);
      const double f = at - static_cast<double>(i);
      s = f * m.basis.equilibria[i];
      if (i > 0) s += (1.0 - f) * m.basis.equilibria[i - 1];
    }
    for (int i = 0; i < k; ++i) s(i) += kTrainingSpread * m.basis.scale(i) * uniform(random);
    for (std::size_t e = 0; e < all.size(); ++e) {
      model::ShellElementState state;
      state.y = all[e].rest + all[e].rows * s;
      state.y_dot.setZero();
      EvaluateShellStrains(all[e].element, m.material, &state);
      model::Matrix5 stiffness, damping;
      ShellStrainTangents(all[e].element, m.material, state, &stiffness, &damping);
      if (m.material.viscosity_pa_s == 0.0) damping.setZero();
      auto column = g.block(t * rows, static_cast<int>(e), rows, 1);
      column.topRows(k) = all[e].rows.transpose() * ShellStrainForce(all[e].element, state);
      const Eigen::MatrixXd a = all[e].rows.transpose() * stiffness * all[e].rows;
      const Eigen::MatrixXd b = all[e].rows.transpose() * damping * all[e].rows;
      column.middleRows(k, k * k) = a.reshaped();
      column.bottomRows(k * k) = b.reshaped();
    }
    const auto normalise = [&](int from, int count) {
      auto block = g.middleRows(t * rows + from, count);
      const double size = block.rowwise().sum().norm();
      if (size > 0.0) block /= size;
    };
    normalise(0, k);
    normalise(k, k * k);
    normalise(k + k * k, k * k);
  }
  return g;
}

void ChooseElements(const Shell& shell, double tolerance, ReducedMantle* m) {
  m->elements = AllElements(*m, shell);
  if (tolerance <= 0.0) return;
  const Cubature chosen = ChooseCubature(TrainingRows(*m, m->elements), tolerance);
  std::vector<CubatureElement> kept;
  for (std::size_t i = 0; i < chosen.column.size(); ++i) {
    kept.push_back(m->elements[chosen.column[i]]);
    kept.back().element.area *= chosen.weight[i];
  }
  m->elements = std::move(kept);
  m->cubature_residual = chosen.residual;
}

void MakeSlices(int count, ReducedMantle* m) {
  const int elements = static_cast<int>(m->reference.size()) - 1;
  if (count <= 0 || count > elements) count = elements;
  const int k = m->size;
  for (int c = 0; c < count; ++c) {
    const int from = elements * c / count, to = elements * (c + 1) / count;
    LateralSlice s{0, 0, 0, VectorX::Zero(k), VectorX::Zero(k), VectorX::Zero(k)};
    // r and z as means over the slice's elements, weighted by their height at rest
    double total = 0;
    const auto height = [&](int e) {
      return std::abs(m->reference[e](1) - m->reference[e + 1](1));
    };
    for (int e = from; e < to; ++e) total += height(e);
    for (int e = from; e < to; ++e) {
      const double w = total > 0.0 ? height(e) / total : 1.0 / (to - from);
      for (int node : {e, e + 1}) {
        s.r += 0.5 * w * m->reference[node](0);
        s.z += 0.5 * w * m->reference[node](1);
        s.r_row += 0.5 * w * m->basis.shapes.row(3 * node).transpose();
        s.z_row += 0.5 * w * m->basis.shapes.row(3 * node + 1).transpose();
      }
    }
    s.height = m->reference[from](1) - m->reference[to](1);
    s.height_row =
        (m->basis.shapes.row(3 * from + 1) - m->basis.shapes.row(3 * to + 1)).transpose();
    m->slices.push_back(std::move(s));
  }
}

void MakePolynomials(const Plant& plant, ReducedMantle* m) {
  const model::Effects& effects = plant.robot.effects;
  const Shell& shell = *plant.shell;
  int outputs = 0, degree = 3;
  m->volume = outputs++;
  for (int i : {0, 1, 2}) m->inertia[i] = outputs++;
  m->inertia[3] = outputs++;
  if (effects.contained_water) {
    m->moment1 = outputs++;
    degree = 4;
  }
  if (effects.lateral_added_mass) degree = 5;
  const bool radial = effects.jet_thrust && effects.jet_thrust->flux == model::FluxReading::kRadial;
  if (radial) {
    m->flux = outputs;
    outputs += m->size;
  }
  if (effects.normal_pressure) {
    m->wall = outputs;
    outputs += m->size;
  }
  model::MantleWaterOptions without_water = plant.water_options;
  without_water.contained_water = false;
  const std::vector<Vector3> still(m->reference.size(), Vector3::Zero());
  std::vector<Vector3> gradient(m->reference.size());
  const auto sample = [&](const VectorX& s, VectorX* y) {
    const std::vector<Vector3> q = Lift(*m, s);
    (*y)(m->volume) = model::ShellVolume(q);
    const model::MantleInertia in = EvaluateMantleInertia(shell, without_water, q, still.data());
    for (int i : {0, 1, 2}) (*y)(m->inertia[i]) = in.lateral[i];
    (*y)(m->inertia[3]) = in.roll;
    if (m->moment1 >= 0) (*y)(m->moment1) = model::EvaluateCavity(q, still.data()).v[1];
    const auto project = [&](int at, bool radial_only) {
      for (int i = 0; i < m->size; ++i) {
        double sum = 0;
        for (std::size_t j = 0; j < q.size(); ++j) {
          const int node = static_cast<int>(j);
          sum += gradient[j](0) * ShapeAt(*m, node, 0, i);
          if (!radial_only) sum += gradient[j](1) * ShapeAt(*m, node, 1, i);
        }
        (*y)(at + i) = sum;
      }
    };
    if (m->flux >= 0) {
      model::ShellVolumeGradient(q, &gradient);
      project(m->flux, true);
    }
    if (m->wall >= 0) {
      model::ShellWallVolumeGradient(q, &gradient);
      project(m->wall, false);
    }
  };
  m->polynomials = Polynomials(degree, m->basis.scale, outputs, sample);
  for (int i = 0; i < 4; ++i) {
    model::MantleInertia unit;
    if (i < 3) unit.lateral[i] = 1.0;
    if (i == 3) {
      unit.roll = 1.0;
      unit.pitch = 0.5;
    }
    m->inertia_pattern[i].setZero();
    AddMantleInertia(unit, false, &m->inertia_pattern[i]);
  }
  model::MantleInertia unit;
  unit.axial = 1.0;
  m->axial_pattern.setZero();
  AddMantleInertia(unit, false, &m->axial_pattern);
}

}  // namespace

ReducedMantle MakeReducedMantle(const Plant& plant, const MantleReduction& reduction) {
  const Shell& shell = *plant.shell;
  ReducedMantle m;
  m.basis = MakeMantleShapes(plant, reduction);
  m.size = static_cast<int>(m.basis.shapes.cols());
  m.reference = shell.reference;
  m.material = shell.material;
  m.loads = plant.mantle_loads;
  m.area_m2 = shell.area_m2;
  m.water_density_kg_m3 = plant.robot.water.density_kg_m3;
  m.solid_volume_m3 = plant.water_options.solid_volume_m3;
  const int n = shell.node_count();
  std::vector<double> mass(n), area(n);
  for (int j = 0; j < n; ++j) {
    mass[j] = shell.nodes[j].inertia(1);
    area[j] = shell.nodes[j].area_m2;
    m.axial_mass_kg += shell.nodes[j].inertia(0);
    m.axial_moment += area[j] * m.reference[j](1);
  }
  m.axial_coupling = Weighted(m, 1, mass);
  m.axial_area = Weighted(m, 1, area);
  m.mean_axial = m.axial_area / shell.area_m2;
  if (plant.robot.effects.jet_thrust) m.thrust = Weighted(m, 1, shell.thrust_share);
  for (const auto& s : shell.strips) m.strips.push_back(Weighted(m, 0, s.strip.area_m2));
  for (const auto& s : shell.spokes) {
    m.spokes.push_back(
        {s.rest_length_m, Weighted(m, 0, s.strip.area_m2) * (s.spokes / s.strip.total_m2)});
  }
  m.radius_rows.setZero(n, m.size);
  m.radius_rest.setZero(n);
  for (int j = 0; j < n; ++j) {
    m.radius_rest(j) = m.reference[j](0);
    m.radius_rows.row(j) = m.basis.shapes.row(3 * j);
  }
  m.lip_z = m.reference.back()(1);
  m.lip_z_row = m.basis.shapes.row(3 * (n - 1) + 1).transpose();
  if (plant.robot.effects.lateral_drag) MakeSlices(reduction.lateral_slices, &m);
  ChooseElements(shell, reduction.cubature_tolerance, &m);
  MakePolynomials(plant, &m);
  return m;
}

}  // namespace mantle::reduced
