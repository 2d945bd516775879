#include "model/energy.h"

#include <algorithm>
#include <cmath>

#include "model/observation.h"

namespace mantle::model {
namespace {

Vector3 CurrentOf(const Plant& plant, const PlantState& state) {
  return EvaluateWater(plant.robot.effects, state.time_s).velocity_m_s;
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
    for (std::size_t k = 0; k < rod.payloads.size(); ++k) {
      const Vector6 carrying = AbsoluteTwist(plant, state, a, rod.payloads[k].node);
      e.kinetic_solid_j += 0.5 * work.payloads[plant.PayloadIndex(a, static_cast<int>(k))] *
                           carrying.dot(rod.payloads[k].inertia * carrying);
    }
    const auto add = [&](const RodNode& place, const Vector6& eta) {
      e.kinetic_solid_j += 0.5 * eta.dot(place.inertia.cwiseProduct(eta));
      e.kinetic_water_j += 0.5 * place.added_mass_kg * eta.tail<2>().squaredNorm();
    };
    Vector6 eta = AbsoluteTwist(plant, state, a, 0);
    add(rod.nodes[0], eta);
    for (int i = 0; i < rod.element_count(); ++i) {
      const Vector6 next = AbsoluteTwist(plant, state, a, i + 1);
      add(rod.middles[i], MiddleTwist(rod.middles[i], work.rod[a][i].middle, eta, next));
      add(rod.nodes[i + 1], next);
      eta = next;
      const RodElement& el = rod.elements[i];
      const Vector6 strain = work.rod[a][i].Strain(el) - el.reference_strain;
      e.elastic_arms_j += 0.5 * el.length * strain.dot(el.stiffness.cwiseProduct(strain));
      if (!rod.coupling.empty()) {
        e.elastic_arms_j += 0.5 * el.length * strain.dot(rod.coupling[i] * strain);
      }
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
    const Rod& rod = plant.rods[a];
    const auto add = [&](const RodNode& place, const Pose& g, const Vector6& eta,
                         const Vector6& eta_dot) {
      const Vector6 inertia = place.FullInertia();
      total += turned(g, eta.head<3>(), inertia.cwiseProduct(eta), inertia.cwiseProduct(eta_dot));
    };
    Vector6 before = Vector6::Zero();
    if (plant.exact()) before = AdjointInverseTimes(rod.mount, acceleration.head<6>());
    for (int i = 0; i < rod.element_count(); ++i) {
      const int at = plant.ArmVelocity(a, i + 1);
      const Vector6 after = acceleration.segment<6>(at);
      const RodNode& place = rod.middles[i];
      const RodMiddle& m = work.rod[a][i].middle;
      const MiddleState& middle = work.middle[a][i];
      add(place, MiddlePose(place, m, state.pose[plant.ArmPose(a, i)]), middle.twist,
          MiddleTwist(place, m, before, after) + middle.bias);
      add(rod.nodes[i + 1], state.pose[plant.ArmPose(a, i + 1)], state.velocity.segment<6>(at),
          after);
      before = after;
      if (rod.payloads.empty()) continue;
      const Matrix6 payload = PayloadInertia(plant, work, a, i + 1);
      const Vector6 eta = state.velocity.segment<6>(at);
      total += turned(state.pose[plant.ArmPose(a, i + 1)], eta.head<3>(), payload * eta,
                      payload * after);
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
  const Vector3 current = CurrentOf(plant, state);
  if (current.isZero(0.0)) return e;
  const SolidMotion solid = EvaluateSolidMotion(plant, state, work);  // the earth's
  const Vector3 carried = solid.mass_kg * current;
  const Vector3 water = EvaluateMomentum(plant, state, work).tail<3>() - solid.momentum_kg_m_s;
  e.kinetic_solid_j += current.dot(solid.momentum_kg_m_s - 0.5 * carried);
  e.kinetic_water_j += current.dot(water);
  return e;
}

EnergyAccount::EnergyAccount(const Plant& plant)
    : names_(plant.power_names.names()), scratch_(VectorX::Zero(plant.velocity_size())) {
  power_.assign(names_.size(), 0.0);
  work_ = pending_ = power_;
}

void EnergyAccount::AddArmPowers(const Plant& plant, int a, const PlantState& state,
                                 const PlantInputs& inputs, const PlantWork& work,
                                 int first_distributed, int first_point) {
  const Rod& rod = plant.rods[a];
  const Vector6 root = state.velocity.head<6>();
  const Vector3 current = CurrentOf(plant, state);
  const auto add = [&](const RodNode& node, const Pose& g, const Vector6& eta, int point_node) {
    SectionMotion motion{g.rotation, eta, inputs.water_acceleration_m_s2};
    if (!plant.exact()) {
      motion.rotation = state.pose[0].rotation * g.rotation;
      motion.twist += AdjointInverseTimes(g, root);
    }
    const Vector6 earth_twist = motion.twist + Carried(motion.rotation, current);
    for (const SectionLoad& load : rod.loads) {
      const double scale = FieldScale(load, inputs.gravity_scale) * node.weight_m;
      std::visit(
          [&](const auto& l) {
            l.AddPower(node.section, motion, earth_twist, scale, power_.data());
          },
          load);
    }
    for (std::size_t k = 0; k < rod.distributed.size(); ++k) {
      const double amplitude = inputs.distributed[first_distributed + k];
      if (amplitude == 0.0) continue;
      // An internal one works on the section's motion relative to the root.
      const bool internal = IsInternal(rod.distributed[k].load);
      Vector6 twist = internal ? motion.twist : earth_twist;
      if (plant.exact() && internal) {
        twist -= AdjointInverseTimes(Inverse(state.pose[0]) * g, root);
      }
      power_[rod.distributed[k].power_place] +=
          node.weight_m * amplitude *
          rod.distributed[k].load.Density(node.section, motion).dot(twist);
    }
    for (std::size_t k = 0; k < rod.points.size(); ++k) {
      if (rod.points[k].node != point_node) continue;
      power_[rod.points[k].power_place] +=
          WrenchInSection(inputs.points[first_point + k] * rod.points[k].load.wrench,
                          rod.points[k].load.frame, motion.rotation)
              .dot(earth_twist);
    }
    for (std::size_t k = 0; k < rod.payloads.size(); ++k) {
      if (rod.payloads[k].node != point_node) continue;
      const double attached = work.payloads[plant.PayloadIndex(a, static_cast<int>(k))];
      for (const RootLoad& load : rod.payloads[k].loads) {
        std::visit(
            [&](const auto& l) {
              l.AddPower(motion, earth_twist, attached * FieldScale(l, inputs.gravity_scale),
                         power_.data());
            },
            load);
      }
    }
  };
  const Pose* pose = &state.pose[plant.ArmPose(a, 0)];
  for (int i = 0; i <= rod.element_count(); ++i) add(rod.nodes[i], pose[i], work.twist[a][i], i);
  for (int i = 0; i < rod.element_count(); ++i) {
    add(rod.middles[i], MiddlePose(rod.middles[i], work.rod[a][i].middle, pose[i]),
        work.middle[a][i].twist, -1);
  }
  for (std::size_t k = 0; k < rod.muscles.size(); ++k) {
    const MuscleInput& in = inputs.muscles[plant.MuscleIndex(a, static_cast<int>(k))];
    for (int i = 0; i < rod.element_count(); ++i) {
      power_[rod.muscles[k].power_place] +=
          MeanMuscleMoment(rod.muscles[k].wave, in, inputs.envelopes.data(), rod.x_m[i],
                           rod.x_m[i + 1])
              .dot(work.rod[a][i].d_dot.head<3>());
    }
  }
  for (std::size_t c = 0; c < rod.cables.size(); ++c) {
    const int index = plant.ArmCableIndex(a, static_cast<int>(c));
    power_[rod.cables[c].power_place] -= work.cable_tension_n[index] * work.cable_rate_m_s[index];
  }
  for (int i = 0; i < rod.element_count(); ++i) {
    const RodElement& e = rod.elements[i];
    const Vector6 rate = work.rod[a][i].StrainRate(e);
    const Vector6 strain = work.rod[a][i].Strain(e) - e.reference_strain;
    stress_power_arms_ += e.length * strain.dot(e.stiffness.cwiseProduct(rate));
    if (!rod.coupling.empty()) {
      stress_power_arms_ += e.length * strain.dot(rod.coupling[i] * rate);
    }
    dissipation_ += e.length * rate.dot(e.viscosity.cwiseProduct(rate));
  }
}

void EnergyAccount::AddMantlePowers(const Plant& plant, const PlantState& state,
                                    const PlantInputs& inputs, const PlantWork& work,
                                    const Vector6& earth_root) {
  const Shell& shell = *plant.shell;
  const ShellMotion motion = MantleMotionOf(plant, state, inputs, work);
  for (std::size_t k = 0; k < shell.strips.size(); ++k) {
    const ShellStrip& s = shell.strips[k];
    for (int j = 0; j < shell.node_count(); ++j) {
      power_[s.power_place] -= inputs.strips_pa[k] * s.strip.area_m2[j] * motion.rate(j)(0);
    }
  }
  for (std::size_t k = 0; k < shell.spokes.size(); ++k) {
    const int index = plant.SpokeIndex(static_cast<int>(k));
    power_[shell.spokes[k].power_place] -= work.cable_tension_n[index] * work.cable_rate_m_s[index];
  }
  for (const MantleLoad& load : plant.mantle_loads) {
    std::visit([&](const auto& l) { l.AddPower(motion, earth_root, power_.data()); }, load);
  }
  for (int i = 0; i < shell.element_count(); ++i) {
    stress_power_mantle_ += ShellElementStressPower(shell.elements[i], work.shell[i]);
    dissipation_ += ShellElementDissipation(shell.elements[i], work.shell[i]);
  }
}

void EnergyAccount::EvaluatePowers(const Plant& plant, const PlantState& state,
                                   const PlantInputs& inputs, const PlantWork& work,
                                   const VectorX& acceleration) {
  const Vector6 root = state.velocity.head<6>();
  // Loads see the water, works are the earth's.
  const Vector6 earth_root = root + Carried(state.pose[0].rotation, CurrentOf(plant, state));
  std::fill(power_.begin(), power_.end(), 0.0);
  dissipation_ = stress_power_arms_ = stress_power_mantle_ = 0;
  int distributed = 0, point = 0;
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    AddArmPowers(plant, a, state, inputs, work, distributed, point);
    distributed += static_cast<int>(plant.rods[a].distributed.size());
    point += static_cast<int>(plant.rods[a].points.size());
  }
  if (plant.shell) AddMantlePowers(plant, state, inputs, work, earth_root);
  const SectionMotion motion{state.pose[0].rotation, root, inputs.water_acceleration_m_s2};
  for (const RootLoad& load : plant.root_loads) {
    std::visit(
        [&](const auto& l) {
          l.AddPower(motion, earth_root, FieldScale(l, inputs.gravity_scale), power_.data());
        },
        load);
  }
  if (plant.water_place >= 0) {  // on the impulse of what is not solid
    const Vector3 impulse = EvaluateMomentum(plant, state, work).tail<3>() -
                            EvaluateSolidMotion(plant, state, work).momentum_kg_m_s;
    power_[plant.water_place] += inputs.water_acceleration_m_s2.dot(impulse);
  }
  if (plant.constraint_place >= 0) {
    ApplyMass(plant, work, acceleration, &scratch_);
    power_[plant.constraint_place] = (scratch_ - work.force).head<6>().dot(earth_root);
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
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {  // the mass moves inside its elements
    for (std::size_t i = 0; i < plant.rods[a].middles.size(); ++i) {
      const MiddleState& middle = work.middle[a][i];
      kinetic += middle.twist.dot(plant.rods[a].middles[i].FullInertia().cwiseProduct(middle.bias));
    }
  }
  if (plant.shell && plant.exact()) {
    Matrix6 rate = Matrix6::Zero();
    AddMantleInertia(work.mantle_inertia, true, &rate);
    kinetic += 0.5 * root.dot(rate * root);
  }
  const Vector3 current = CurrentOf(plant, state);
  if (!current.isZero(0.0)) {
    kinetic += current.dot(MomentumRate(plant, state, work, acceleration));
  }
  if (plant.water_place >= 0) {
    const Vector3 by_water = EvaluateWater(plant.robot.effects, state.time_s).acceleration_m_s2;
    kinetic += by_water.dot(EvaluateMomentum(plant, state, work).tail<3>());
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
