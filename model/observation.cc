#include "model/observation.h"

#include "model/rigid_body.h"

namespace mantle::model {
namespace {

// Pose of a node as seen from the root.
Pose FromRoot(const Plant& plant, const PlantState& state, int arm, int node) {
  const Pose& g = state.pose[plant.ArmPose(arm, node)];
  return plant.exact() ? Inverse(state.pose[0]) * g : g;
}

// In the frame that drifts with the current.
SolidMotion SolidMotionInWater(const Plant& plant, const PlantState& state, const PlantWork& work) {
  SolidMotion out;
  const Pose& root = state.pose[0];
  const Vector6 eta = state.velocity.head<6>();
  const auto add = [&](double mass, const Vector3& position, const Vector3& velocity) {
    out.mass_kg += mass;
    out.centre_m += mass * position;
    out.momentum_kg_m_s += mass * velocity;
  };
  const auto fixed = [&](double mass, const Vector3& at) {
    add(mass, root.position + root.rotation * at,
        root.rotation * (eta.tail<3>() + eta.head<3>().cross(at)));
  };
  if (plant.robot.rigid_body) {
    fixed(RigidMass(*plant.robot.rigid_body), RigidCentre(*plant.robot.rigid_body));
  }
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    for (int i = 0; i <= plant.rods[a].element_count(); ++i) {
      const Pose g = AbsolutePose(plant, state, a, i);
      add(plant.rods[a].nodes[i].inertia(5), g.position,
          g.rotation * AbsoluteTwist(plant, state, a, i).tail<3>());
    }
    for (int i = 0; i < plant.rods[a].element_count(); ++i) {
      const PlaceMotion m = AbsoluteMiddle(plant, state, a, i);
      add(plant.rods[a].middles[i].inertia(5), m.pose.position,
          m.pose.rotation * m.twist.tail<3>());
    }
    for (std::size_t k = 0; k < plant.rods[a].payloads.size(); ++k) {
      const RodPayload& p = plant.rods[a].payloads[k];
      const double attached = work.payloads[plant.PayloadIndex(a, static_cast<int>(k))];
      const Pose g = AbsolutePose(plant, state, a, p.node);
      const Vector6 eta_p = AbsoluteTwist(plant, state, a, p.node);
      const Vector3& centre = p.payload.offset_m;
      add(attached * p.payload.mass_kg, g.position + g.rotation * centre,
          g.rotation * (eta_p.tail<3>() + eta_p.head<3>().cross(centre)));
    }
  }
  for (int j = 0; j < plant.shape_count(); ++j) {
    const double mass = plant.shell->nodes[j].mass_kg;
    fixed(mass, Vector3(0, 0, state.shape[j](1)));
    const double rate = state.velocity(plant.ShellVelocity(j) + 1);
    out.momentum_kg_m_s += root.rotation * Vector3(0, 0, mass * rate);
  }
  if (out.mass_kg > 0) out.centre_m /= out.mass_kg;
  return out;
}

}  // namespace

SolidMotion EvaluateSolidMotion(const Plant& plant, const PlantState& state,
                                const PlantWork& work) {
  SolidMotion out = SolidMotionInWater(plant, state, work);
  const WaterMotion water = EvaluateWater(plant.robot.effects, state.time_s);
  out.centre_m += water.drift_m;
  out.momentum_kg_m_s += out.mass_kg * water.velocity_m_s;
  return out;
}

Vector6 EvaluateMomentum(const Plant& plant, const PlantState& state, const PlantWork& work) {
  Vector6 p = work.root_mass * state.velocity.head<6>();
  if (plant.shell && plant.exact()) p(5) += work.mantle_inertia.axial_momentum;
  Vector6 total = AdjointInverseTransposeTimes(state.pose[0], p);
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    for (int i = 1; i <= plant.rods[a].element_count(); ++i) {
      const Vector6 eta = state.velocity.segment<6>(plant.ArmVelocity(a, i));
      total += AdjointInverseTransposeTimes(AbsolutePose(plant, state, a, i),
                                            plant.rods[a].nodes[i].FullInertia().cwiseProduct(eta));
    }
    for (int i = 0; i < plant.rods[a].element_count(); ++i) {
      const PlaceMotion m = AbsoluteMiddle(plant, state, a, i);
      total += AdjointInverseTransposeTimes(
          m.pose, plant.rods[a].middles[i].FullInertia().cwiseProduct(m.twist));
    }
    for (const RodPayload& p : plant.rods[a].payloads) {
      if (p.node == 0) continue;  // in root_mass
      const double attached = work.payloads[plant.PayloadIndex(
          a, static_cast<int>(&p - plant.rods[a].payloads.data()))];
      const Vector6 eta = state.velocity.segment<6>(plant.ArmVelocity(a, p.node));
      total += attached *
               AdjointInverseTransposeTimes(AbsolutePose(plant, state, a, p.node), p.inertia * eta);
    }
  }
  const WaterMotion water = EvaluateWater(plant.robot.effects, state.time_s);
  const Vector3& current = water.velocity_m_s;
  if (!current.isZero(0.0) || !water.drift_m.isZero(0.0)) {
    const SolidMotion solid = SolidMotionInWater(plant, state, work);
    const Vector3 impulse = total.tail<3>();
    const Vector3 carried = solid.mass_kg * current;
    total.head<3>() +=
        water.drift_m.cross(Vector3(impulse + carried)) + solid.centre_m.cross(carried);
    total.tail<3>() += carried;
  }
  return total;
}

double LockedPower(const Plant& plant, const PlantState& state, const PlantWork& work,
                   const Vector6& root_acceleration) {
  const Vector6 eta = state.velocity.head<6>();
  double power = eta.dot(work.root_mass * root_acceleration);
  if (!plant.exact()) return power;  // the locked inertia already
  const auto add = [&](const RodNode& place, const Pose& h) {
    power += AdjointInverseTimes(h, eta).dot(
        place.FullInertia().cwiseProduct(AdjointInverseTimes(h, root_acceleration)));
  };
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    const Rod& rod = plant.rods[a];
    for (int i = 0; i < rod.element_count(); ++i) {
      add(rod.middles[i],
          MiddlePose(rod.middles[i], work.rod[a][i].middle, FromRoot(plant, state, a, i)));
      add(rod.nodes[i + 1], FromRoot(plant, state, a, i + 1));
    }
    for (const RodPayload& p : plant.rods[a].payloads) {
      if (p.node == 0) continue;
      const double attached = work.payloads[plant.PayloadIndex(
          a, static_cast<int>(&p - plant.rods[a].payloads.data()))];
      const Pose h = FromRoot(plant, state, a, p.node);
      power += attached * AdjointInverseTimes(h, eta).dot(
                              p.inertia * AdjointInverseTimes(h, root_acceleration));
    }
  }
  return power;
}

}  // namespace mantle::model
