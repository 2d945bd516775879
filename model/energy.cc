#include "model/energy.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/mantle_loads.h"
#include "model/observation.h"
#include "model/rigid_body.h"

namespace mantle::model {
namespace {

constexpr const char* kWeight = "weight";
constexpr const char* kBuoyancy = "buoyancy";

// Visits (gravity density factor, name) of the two gravity effects a scene names.
template <typename Visit>
void ForEachGravity(const Effects& effects, double body_density, double water_density,
                    Visit visit) {
  if (effects.weight) visit(body_density);
  if (effects.buoyancy) visit(-water_density);
}

Vector3 CurrentOf(const Plant& plant) {
  return plant.robot.effects.current_m_s.value_or(Vector3::Zero());
}

// The current as a rigid translation of the frame `rotation`.
Vector6 Carried(const Eigen::Quaterniond& rotation, const Vector3& current) {
  Vector6 twist;
  twist << Vector3::Zero(), rotation.conjugate() * current;
  return twist;
}

// As the water sees them.
Energies EnergiesInWater(const Plant& plant, const PlantState& state, const PlantWork& work) {
  Energies e;
  const Vector6 root = state.velocity.head<6>();
  e.kinetic_solid_j += 0.5 * root.dot(plant.rigid_inertia * root);
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    const Rod& rod = plant.rods[a];
    for (int i = 0; i <= rod.element_count(); ++i) {
      const Vector6 eta = AbsoluteTwist(plant, state, a, i);
      e.kinetic_solid_j += 0.5 * eta.dot(rod.nodes[i].inertia.cwiseProduct(eta));
      e.kinetic_water_j += 0.5 * rod.nodes[i].added_mass_kg * eta.tail<2>().squaredNorm();
    }
    for (int i = 0; i < rod.element_count(); ++i) {
      const RodElement& el = rod.elements[i];
      const Vector6 strain = work.rod[a][i].Strain(el) - el.reference_strain;
      e.elastic_arms_j += 0.5 * el.length * strain.dot(el.stiffness.cwiseProduct(strain));
    }
  }
  if (!plant.shell) return e;
  const Shell& shell = *plant.shell;
  double rates = 0, rotary = 0;
  for (int j = 0; j < shell.node_count(); ++j) {
    const Vector3 v = state.velocity.segment<3>(plant.ShellVelocity(j));
    rates += 0.5 * shell.nodes[j].mass_kg * v.head<2>().squaredNorm();
    rotary += 0.5 * shell.nodes[j].inertia(2) * v(2) * v(2);
  }
  Matrix6 inertia = Matrix6::Zero();
  AddMantleInertia(work.mantle_inertia, false, &inertia);
  const double factor = 1.0 + shell.added_mass_factor;
  const double total = 0.5 * root.dot(inertia * root) + factor * rates + rotary +
                       work.mantle_inertia.axial_momentum * root(5);
  // Solid share: the same energy without any water.
  MantleInertia solid = work.mantle_inertia;
  double l[3] = {0, 0, 0};
  for (int j = 0; j < shell.node_count(); ++j) {
    const double m = shell.nodes[j].mass_kg, z = state.shape[j](1);
    l[0] += m;
    l[1] += m * z;
    l[2] += m * z * z;
  }
  for (int k = 0; k < 3; ++k) solid.lateral[k] = l[k];
  solid.axial /= factor;
  solid.pitch /= factor;
  solid.roll /= factor;
  Matrix6 solid_inertia = Matrix6::Zero();
  AddMantleInertia(solid, false, &solid_inertia);
  const double solid_energy = 0.5 * root.dot(solid_inertia * root) + rates + rotary +
                              work.mantle_inertia.axial_momentum / factor * root(5);
  e.kinetic_solid_j += solid_energy;
  e.kinetic_water_j += total - solid_energy;
  for (int i = 0; i < shell.element_count(); ++i) {
    e.elastic_mantle_j += ShellElementEnergy(shell.elements[i], work.shell[i]);
  }
  return e;
}

// Rate of the linear momentum of solid and added mass, world axes.
Vector3 MomentumRate(const Plant& plant, const PlantState& state, const PlantWork& work,
                     const VectorX& acceleration) {
  const Vector6 root = state.velocity.head<6>();
  Vector6 momentum = work.root_mass * root;
  Vector6 rate = work.root_mass * acceleration.head<6>();
  if (plant.shell && plant.exact()) {
    Matrix6 inertia_rate = Matrix6::Zero();
    AddMantleInertia(work.mantle_inertia, true, &inertia_rate);
    momentum(5) += work.mantle_inertia.axial_momentum;
    rate += inertia_rate * root;
    for (int j = 0; j < plant.shape_count(); ++j) {
      rate(5) += plant.shell->nodes[j].inertia(1) * acceleration(plant.ShellVelocity(j) + 1);
    }
  }
  const auto turned = [](const Pose& g, const Vector3& w, const Vector6& p, const Vector6& p_dot) {
    return Vector3(g.rotation * (p_dot.tail<3>() + w.cross(p.tail<3>())));
  };
  Vector3 total = turned(state.pose[0], root.head<3>(), momentum, rate);
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    for (int i = 1; i <= plant.rods[a].element_count(); ++i) {
      const int at = plant.ArmVelocity(a, i);
      const Vector6 inertia = plant.rods[a].nodes[i].FullInertia();
      const Vector6 eta = state.velocity.segment<6>(at);
      total += turned(state.pose[plant.ArmPose(a, i)], eta.head<3>(), inertia.cwiseProduct(eta),
                      inertia.cwiseProduct(acceleration.segment<6>(at)));
    }
  }
  return total;
}

}  // namespace

double Energies::magnitude() const {
  return std::abs(kinetic_solid_j) + std::abs(kinetic_water_j) + std::abs(elastic_arms_j) +
         std::abs(elastic_mantle_j);
}

Energies EvaluateEnergies(const Plant& plant, const PlantState& state, const PlantWork& work) {
  Energies e = EnergiesInWater(plant, state, work);
  const Vector3 current = CurrentOf(plant);
  if (current.isZero(0.0)) return e;
  const SolidMotion solid = EvaluateSolidMotion(plant, state);  // the earth's
  const Vector3 carried = solid.mass_kg * current;
  const Vector3 water = EvaluateMomentum(plant, state, work).tail<3>() - solid.momentum_kg_m_s;
  e.kinetic_solid_j += current.dot(solid.momentum_kg_m_s - 0.5 * carried);
  e.kinetic_water_j += current.dot(water);
  return e;
}

EnergyAccount::EnergyAccount(const Plant& plant) : scratch_(VectorX::Zero(plant.velocity_size())) {
  const Effects& effects = plant.robot.effects;
  if (effects.weight) names_.push_back(kWeight);
  if (effects.buoyancy) names_.push_back(kBuoyancy);
  for (const Rod& rod : plant.rods) {
    if (effects.drag) names_.push_back("drag." + rod.name);
    for (const auto& d : rod.distributed)
      names_.push_back("distributed." + rod.name + "." + d.name);
    for (const auto& p : rod.points) names_.push_back("point." + rod.name + "." + p.load.name);
    for (const auto& c : rod.cables) names_.push_back("cable." + rod.name + "." + c.name);
  }
  if (plant.shell) {
    const std::string& name = plant.shell->name;
    for (const auto& s : plant.shell->strips)
      names_.push_back("strip." + name + "." + s.strip.name);
    for (const auto& s : plant.shell->spokes)
      names_.push_back("cable." + name + "." + s.strip.name);
    if (effects.normal_pressure) names_.push_back("normal_pressure");
    if (effects.jet_thrust) names_.push_back("jet_thrust");
    if (effects.drag) names_.push_back("drag." + name);
    if (effects.lateral_drag) names_.push_back("lateral_drag");
    if (effects.contained_water) names_.push_back("contained_water");
  }
  if (effects.roll_drag) names_.push_back("roll_drag");
  if (effects.rigid_drag) names_.push_back("rigid_drag");
  if (!plant.root_free()) names_.push_back("root_constraint");
  power_.assign(names_.size(), 0.0);
  work_ = pending_ = power_;
}

void EnergyAccount::EvaluatePowers(const Plant& plant, const PlantState& state,
                                   const PlantInputs& inputs, const PlantWork& work,
                                   const VectorX& acceleration) {
  const Effects& effects = plant.robot.effects;
  const double rho = plant.robot.water.density_kg_m3;
  const Vector6 root = state.velocity.head<6>();
  const Vector3 current = CurrentOf(plant);
  const Vector6 carried_root = Carried(state.pose[0].rotation, current);
  const Vector6 earth_root = root + carried_root;  // works are the earth's, loads see the water
  const Vector3 g_root =
      inputs.gravity_scale * (state.pose[0].rotation.conjugate() * effects.gravity_m_s2);
  std::fill(power_.begin(), power_.end(), 0.0);
  dissipation_ = stress_power_arms_ = stress_power_mantle_ = 0;

  const std::size_t gravity_at = 0;
  std::size_t at = (effects.weight ? 1 : 0) + (effects.buoyancy ? 1 : 0);
  std::size_t distributed = 0, point = 0;
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    const Rod& rod = plant.rods[a];
    const std::size_t drag_at = at;
    const std::size_t distributed_at = drag_at + (effects.drag ? 1 : 0);
    const std::size_t point_at = distributed_at + rod.distributed.size();
    for (int i = 0; i <= rod.element_count(); ++i) {
      const Pose& g = state.pose[plant.ArmPose(a, i)];
      SectionMotion motion{g.rotation, work.twist[a][i]};
      if (!plant.exact()) {
        motion.rotation = state.pose[0].rotation * g.rotation;
        motion.twist += AdjointInverseTimes(g, root);
      }
      const Vector6 earth_twist = motion.twist + Carried(motion.rotation, current);
      const RodNode& node = rod.nodes[i];
      for (const SectionLoad& load : rod.loads) {
        if (const auto* gravity = std::get_if<GravityLoad>(&load)) {
          const double fall =
              inputs.gravity_scale * node.weight_m * node.section.area_m2 *
              (motion.rotation.conjugate() * gravity->gravity_m_s2).dot(earth_twist.tail<3>());
          std::size_t k = gravity_at;
          ForEachGravity(effects, gravity->body_density_kg_m3, gravity->water_density_kg_m3,
                         [&](double density) { power_[k++] += density * fall; });
        } else {
          power_[drag_at] +=
              node.weight_m *
              std::get<DragLoad>(load).Density(node.section, motion).dot(earth_twist);
        }
      }
      for (std::size_t k = 0; k < rod.distributed.size(); ++k) {
        const double amplitude = inputs.distributed[distributed + k];
        if (amplitude == 0.0) continue;
        // An internal one works on the section's motion relative to the root.
        const bool internal = IsInternal(rod.distributed[k].load);
        Vector6 twist = internal ? motion.twist : earth_twist;
        if (plant.exact() && internal) {
          twist -= AdjointInverseTimes(Inverse(state.pose[0]) * g, root);
        }
        power_[distributed_at + k] +=
            node.weight_m * amplitude *
            rod.distributed[k].load.Density(node.section, motion).dot(twist);
      }
      for (std::size_t k = 0; k < rod.points.size(); ++k) {
        if (rod.points[k].node != i) continue;
        power_[point_at + k] +=
            WrenchInSection(inputs.points[point + k] * rod.points[k].load.wrench,
                            rod.points[k].load.frame, motion.rotation)
                .dot(earth_twist);
      }
    }
    at = point_at + rod.points.size();
    for (std::size_t c = 0; c < rod.cables.size(); ++c) {
      const int index = plant.ArmCableIndex(a, static_cast<int>(c));
      power_[at++] = -work.cable_tension_n[index] * work.cable_rate_m_s[index];
    }
    distributed += rod.distributed.size();
    point += rod.points.size();
    for (int i = 0; i < rod.element_count(); ++i) {
      const RodElement& e = rod.elements[i];
      const Vector6 rate = work.rod[a][i].StrainRate(e);
      const Vector6 strain = work.rod[a][i].Strain(e) - e.reference_strain;
      stress_power_arms_ += e.length * strain.dot(e.stiffness.cwiseProduct(rate));
      dissipation_ += e.length * rate.dot(e.viscosity.cwiseProduct(rate));
    }
  }
  if (plant.shell) {
    const Shell& shell = *plant.shell;
    const Mantle& mantle = *plant.robot.mantle;
    const auto rate = [&](int j) -> Vector3 {
      return state.velocity.segment<3>(plant.ShellVelocity(j));
    };
    if (plant.has_gravity()) {
      double moment = 0, axial = 0;
      for (int j = 0; j < shell.node_count(); ++j) {
        moment += shell.nodes[j].area_m2 * state.shape[j](1);
        if (plant.exact()) axial += shell.nodes[j].area_m2 * rate(j)(1);
      }
      const double fall =
          2.0 * mantle.half_thickness_m *
          (shell.area_m2 * g_root.dot(earth_root.tail<3>()) +
           moment * (g_root.x() * root(1) - g_root.y() * root(0)) + g_root.z() * axial);
      std::size_t k = gravity_at;
      ForEachGravity(effects, mantle.material.density_kg_m3, rho,
                     [&](double density) { power_[k++] += density * fall; });
    }
    for (std::size_t k = 0; k < shell.strips.size(); ++k) {
      for (int j = 0; j < shell.node_count(); ++j) {
        power_[at] -= inputs.strips_pa[k] * shell.strips[k].strip.area_m2[j] * rate(j)(0);
      }
      ++at;
    }
    for (std::size_t k = 0; k < shell.spokes.size(); ++k) {
      const int index = plant.SpokeIndex(static_cast<int>(k));
      power_[at++] = -work.cable_tension_n[index] * work.cable_rate_m_s[index];
    }
    if (effects.normal_pressure) {
      // pressure times the rate of the wall's swept volume: U_dot plus the end planes' share
      const auto plane = [&](int j) {
        const double r = state.shape[j](0);
        return std::numbers::pi * r * r * rate(j)(1);
      };
      const int n = shell.element_count();
      power_[at++] = inputs.normal_pressure_pa * (work.volume_rate_m3_s + plane(n) - plane(0));
    }
    if (effects.jet_thrust) {
      double speed = earth_root(5);
      for (int j = 0; j < shell.node_count(); ++j) speed += shell.thrust_share[j] * rate(j)(1);
      power_[at++] = work.thrust_n * speed;
    }
    if (effects.drag)
      power_[at++] = work.mantle_drag_n * (work.mean_axial_speed_m_s + carried_root(5));
    if (effects.lateral_drag) {
      power_[at++] = MantleLateralDrag(state.shape, rho, effects.lateral_drag->coefficient, root)
                         .dot(earth_root);
    }
    if (effects.contained_water) {
      const MantleInertia& m = work.mantle_inertia;
      const double u1 = root(3) + root(1) * m.centroid_m;
      const double u2 = root(4) - root(0) * m.centroid_m;
      power_[at++] = OutflowWrench(m, state.shape.back()(1), root).dot(earth_root) -
                     0.5 * m.contained_rate_kg_s * (u1 * u1 + u2 * u2);
    }
    for (int i = 0; i < shell.element_count(); ++i) {
      stress_power_mantle_ += ShellElementStressPower(shell.elements[i], work.shell[i]);
      dissipation_ += ShellElementDissipation(shell.elements[i], work.shell[i]);
    }
  }
  if (plant.has_gravity() && plant.robot.rigid_body) {
    const double fall =
        g_root.dot(earth_root.tail<3>() + root.head<3>().cross(plant.buoyant_centre_m));
    std::size_t k = gravity_at;
    if (effects.weight) power_[k++] += RigidMass(*plant.robot.rigid_body) * fall;
    if (effects.buoyancy) power_[k++] -= rho * RigidVolume(*plant.robot.rigid_body) * fall;
  }
  if (effects.roll_drag) power_[at++] = RollDragWrench(*effects.roll_drag, root).dot(root);
  if (effects.rigid_drag) {
    power_[at++] =
        plant.robot.rigid_body
            ? RigidBodyDrag(*plant.robot.rigid_body, *effects.rigid_drag, rho, root).dot(earth_root)
            : 0.0;
  }
  if (!plant.root_free()) {
    ApplyMass(plant, work, acceleration, &scratch_);
    power_[at++] = (scratch_ - work.force).head<6>().dot(earth_root);
  }
}

void EnergyAccount::Begin() {
  std::fill(pending_.begin(), pending_.end(), 0.0);
  pending_dissipation_ = 0;
}

void EnergyAccount::Accumulate(double weight_s) {
  for (std::size_t i = 0; i < power_.size(); ++i) pending_[i] += weight_s * power_[i];
  pending_dissipation_ += weight_s * dissipation_;
}

void EnergyAccount::Commit() {
  for (std::size_t i = 0; i < power_.size(); ++i) work_[i] += pending_[i];
  dissipated_ += pending_dissipation_;
}

EnergyAccount::Balance EnergyAccount::EvaluateBalance(const Plant& plant, const PlantState& state,
                                                      const PlantWork& work,
                                                      const VectorX& acceleration) {
  ApplyMass(plant, work, acceleration, &scratch_);
  const Vector6 root = state.velocity.head<6>();
  double kinetic = state.velocity.dot(scratch_);
  if (plant.shell && plant.exact()) {
    Matrix6 rate = Matrix6::Zero();
    AddMantleInertia(work.mantle_inertia, true, &rate);
    kinetic += 0.5 * root.dot(rate * root);
  }
  const Vector3 current = CurrentOf(plant);
  if (!current.isZero(0.0)) {
    kinetic += current.dot(MomentumRate(plant, state, work, acceleration));
  }
  double sum = kinetic + stress_power_arms_ + stress_power_mantle_ + dissipation_;
  double scale = std::abs(kinetic) + std::abs(stress_power_arms_) + std::abs(stress_power_mantle_) +
                 dissipation_;
  for (double p : power_) {
    sum -= p;
    scale += std::abs(p);
  }
  return {sum, scale};
}

}  // namespace mantle::model
