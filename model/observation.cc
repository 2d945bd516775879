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
SolidMotion SolidMotionInWater(const Plant& plant, const PlantState& state) {
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

SolidMotion EvaluateSolidMotion(const Plant& plant, const PlantState& state) {
  SolidMotion out = SolidMotionInWater(plant, state);
  if (const auto& current = plant.robot.effects.current_m_s) {
    out.centre_m += state.time_s * *current;
    out.momentum_kg_m_s += out.mass_kg * *current;
  }
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
  }
  if (const auto& current = plant.robot.effects.current_m_s) {
    const SolidMotion solid = SolidMotionInWater(plant, state);
    const Vector3 impulse = total.tail<3>();
    total.head<3>() +=
        state.time_s * current->cross(impulse) + solid.mass_kg * solid.centre_m.cross(*current);
    total.tail<3>() += solid.mass_kg * *current;
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
  }
  return power;
}

}  // namespace mantle::model
