#include "model/plant.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/meridian.h"
#include "model/mismatch.h"
#include "model/rigid_body.h"
#include "model/root_motion.h"

namespace mantle::model {
namespace {

// Twists that differ by no more are the same but for round-off [rad/s, m/s, and relative].
constexpr double kSameTwist = 1e-13;

template <typename Build>
auto Named(const std::string& path, Build build) {
  try {
    return build();
  } catch (const BadRobot& error) {
    throw BadRobot(path + "." + error.what());
  }
}

double Extent(const Robot& robot) {
  double length = 0;
  for (const Arm& arm : robot.arms) {
    length = std::max(length, arm.mount.position.norm() + arm.length_m);
  }
  if (robot.mantle) length = std::max(length, MeridianLength(*robot.mantle));
  if (length > 0 || !robot.rigid_body) return length;
  // A rigid body alone: a cone's height, or the size of a ball of that radius of gyration.
  if (const Cone* cone = std::get_if<Cone>(&robot.rigid_body->shape)) return cone->height_m;
  const auto& given = std::get<GivenInertia>(robot.rigid_body->shape);
  const double gyration = std::sqrt(given.inertia_kg_m2.trace() / given.mass_kg);
  return gyration > 0 ? 2.0 * gyration : 1.0;
}

}  // namespace

Plant::Plant(const Robot& r) : robot(WithActualBodies(r)) {
  if (robot.arms.empty() && !robot.mantle && !robot.rigid_body) {
    throw BadRobot("robot: has no bodies, needs an arm, a mantle or a rigid body");
  }
  CheckRootMotion(robot);
  if (!exact()) {
    const char* frozen = "robot.coupling = \"frozen\": must be \"exact\" with ";
    for (const Arm& arm : robot.arms) {
      if (!arm.payloads.empty()) throw BadRobot(frozen + ("arms." + arm.name + ".payloads"));
    }
    if (robot.effects.unsteady_current) {
      throw BadRobot(std::string(frozen) + "a current that changes in time");
    }
  }
  for (std::size_t i = 0; i < robot.arms.size(); ++i) {
    rods.push_back(Named(fmt::format("arms.{}", robot.arms[i].name),
                         [&] { return MakeRod(robot.arms[i], robot.water, robot.effects); }));
  }
  if (robot.mantle) {
    shell = Named("mantle", [&] { return MakeShell(*robot.mantle, robot.water, robot.effects); });
  }
  int muscles = 0, payloads = 0;
  for (const Rod& rod : rods) {
    muscle_offset_.push_back(muscles);
    payload_offset_.push_back(payloads);
    muscles += static_cast<int>(rod.muscles.size());
    payloads += static_cast<int>(rod.payloads.size());
    pose_offset_.push_back(pose_count_);
    velocity_offset_.push_back(velocity_size_);
    cable_offset_.push_back(cable_count_);
    pose_count_ += rod.element_count() + 1;
    velocity_size_ += 6 * rod.element_count();
    cable_count_ += static_cast<int>(rod.cables.size());
  }
  shell_offset_ = velocity_size_;
  spoke_offset_ = cable_count_;
  if (shell) {
    velocity_size_ += 3 * shell->node_count();
    cable_count_ += static_cast<int>(shell->spokes.size());
  }
  water_options.water_density_kg_m3 = robot.water.density_kg_m3;
  water_options.lateral_added_mass = robot.effects.lateral_added_mass;
  water_options.contained_water = robot.effects.contained_water;
  if (robot.rigid_body) {
    rigid_inertia = RigidInertia(*robot.rigid_body);
    water_options.solid_volume_m3 = RigidVolume(*robot.rigid_body);
  }
  root_inertia = rigid_inertia;
  if (exact()) {
    for (const Rod& rod : rods) {
      const Vector6 m = rod.nodes[0].FullInertia();
      const Matrix6 ad = Adjoint(Inverse(rod.mount));
      root_inertia += ad.transpose() * m.asDiagonal() * ad;
    }
  }
  if (root_free()) {
    Matrix6 total = root_inertia;
    if (shell) {
      AddMantleInertia(
          EvaluateMantleInertia(*shell, water_options, shell->reference,
                                std::vector<Vector3>(shell->node_count(), Vector3::Zero()).data()),
          false, &total);
    }
    for (const Rod& rod : rods) {
      double mass = 0;
      for (const RodNode& n : rod.nodes) mass += n.inertia(5);
      for (const RodNode& n : rod.middles) mass += n.inertia(5);
      if (!(mass > 0))
        throw BadRobot("arms." + rod.name + ": density = 0 on a free root, must be > 0");
    }
    if (!(total.llt().info() == Eigen::Success)) {
      throw BadRobot(
          "root: a free root has no inertia about every axis; give it a rigid body, or "
          "clamp it");
    }
  }
  for (const Rod& rod : rods) {
    for (const RodCable& c : rod.cables) cable_rest_m.push_back(c.rest_length_m);
  }
  if (shell) {
    for (const ShellSpokes& s : shell->spokes) cable_rest_m.push_back(s.rest_length_m);
  }
  body_length_m = robot.body_length_m > 0 ? robot.body_length_m : Extent(robot);
  MakeLoads();
}

void Plant::MakeLoads() {
  root_loads = RootLoads(robot);
  if (shell) mantle_loads = MantleLoads(*robot.mantle, robot.water, robot.effects);
  const auto scale = [&](auto* loads) {
    for (auto& load : *loads) std::visit([&](auto& l) { l.Scale(robot.mismatch); }, load);
  };
  for (Rod& rod : rods) scale(&rod.loads);
  scale(&mantle_loads);
  scale(&root_loads);

  if (robot.effects.weight) power_names.Place(kWeightName);  // of all bodies, and first
  if (robot.effects.buoyancy) power_names.Place(kBuoyancyName);
  const auto place = [&](const char* kind, const std::string& body, const std::string& name) {
    return power_names.Place(fmt::format("{}.{}.{}", kind, body, name));
  };
  for (Rod& rod : rods) {
    for (SectionLoad& load : rod.loads) {
      std::visit([&](auto& l) { l.Name(rod.name, &power_names); }, load);
    }
    for (auto& d : rod.distributed) d.power_place = place("distributed", rod.name, d.name);
    for (auto& p : rod.points) p.power_place = place("point", rod.name, p.load.name);
    for (auto& m : rod.muscles) m.power_place = place("muscle", rod.name, m.wave.name);
    for (auto& p : rod.payloads) {
      for (RootLoad& load : p.loads) {
        std::visit([&](auto& l) { l.Name(&power_names); }, load);
      }
      if (p.payload.drop_s) p.power_place = place("dropped", rod.name, p.payload.name);
    }
    for (auto& c : rod.cables) c.power_place = place("cable", rod.name, c.name);
  }
  if (shell) {
    for (auto& s : shell->strips) s.power_place = place("strip", shell->name, s.strip.name);
    for (auto& s : shell->spokes) s.power_place = place("cable", shell->name, s.strip.name);
  }
  for (MantleLoad& load : mantle_loads) {
    std::visit([&](auto& l) { l.Name(shell->name, &power_names); }, load);
  }
  for (RootLoad& load : root_loads) {
    std::visit([&](auto& l) { l.Name(&power_names); }, load);
  }
  if (robot.effects.unsteady_current) water_place = power_names.Place(kWaterAccelerationName);
  if (!root_free()) constraint_place = power_names.Place("root_constraint");
}

PlantState InitialState(const Plant& plant, double t_s) {
  PlantState s;
  s.time_s = t_s;
  s.pose.resize(plant.pose_count());
  s.velocity = VectorX::Zero(plant.velocity_size());
  const RootKinematics start = EvaluateRootMotion(plant.robot, t_s);
  s.pose[0] = start.pose;
  const Vector6& root_twist = start.twist;
  s.velocity.head<6>() = root_twist;
  const Pose root = plant.exact() ? s.pose[0] : Pose::Identity();
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    const Rod& rod = plant.rods[a];
    const Arm& arm = plant.robot.arms[a];
    const int arm_index = static_cast<int>(a);
    for (int i = 0; i <= rod.element_count(); ++i) {
      s.pose[plant.ArmPose(arm_index, i)] = root * rod.mount * rod.reference[i];
      if (i == 0) continue;
      auto v = s.velocity.segment<6>(plant.ArmVelocity(arm_index, i));
      const Pose from_root = rod.mount * rod.reference[i];
      if (plant.exact()) v = AdjointInverseTimes(from_root, root_twist);
      v += AdjointInverseTimes(rod.reference[i], arm.initial_twist);
    }
  }
  if (plant.shell) {
    s.shape = plant.shell->reference;
    for (int j = 0; j < plant.shell->node_count(); ++j) {
      s.velocity(plant.ShellVelocity(j)) =
          (1.0 - plant.shell->nodes[j].held(0)) * plant.robot.mantle->initial_radial_speed_m_s;
    }
  }
  return s;
}

void Retract(const Plant& plant, const PlantState& from, const VectorX& theta, PlantState* to) {
  to->pose[0] = from.pose[0] * ExpSE3(theta.head<6>());
  to->pose[0].rotation.normalize();
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    const Rod& rod = plant.rods[a];
    const int base = plant.ArmPose(static_cast<int>(a), 0);
    const int v = plant.ArmVelocity(static_cast<int>(a), 1);
    to->pose[base] = plant.exact() ? to->pose[0] * rod.mount : rod.mount;
    for (int i = 1; i <= rod.element_count(); ++i) {
      to->pose[base + i] = from.pose[base + i] * ExpSE3(theta.segment<6>(v + 6 * (i - 1)));
      to->pose[base + i].rotation.normalize();
    }
  }
  for (int j = 0; j < plant.shape_count(); ++j) {
    to->shape[j] = from.shape[j] + theta.segment<3>(plant.ShellVelocity(j));
  }
}

void EvaluateInputs(const Plant& plant, double t_s, bool from_left, PlantInputs* inputs) {
  EvaluateInputs(plant.robot, plant.cable_rest_m, t_s, from_left, inputs);
}

double NextBreakpoint(const Plant& plant, double t_s) { return NextBreakpoint(plant.robot, t_s); }

void ImposeRoot(const Plant& plant, const PlantInputs& inputs, PlantState* state) {
  if (!plant.root_free()) {
    state->pose[0] = inputs.root_pose;
    state->velocity.head<6>() = inputs.root_twist;
  }
  if (!plant.exact()) return;
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    state->pose[plant.ArmPose(static_cast<int>(a), 0)] = state->pose[0] * plant.rods[a].mount;
  }
}

EvaluationFailure CrossRootKink(const Plant& plant, PlantInputs* inputs, PlantWork* work,
                                PlantState* state) {
  EvaluateInputs(plant, state->time_s, false, inputs);
  if (plant.root_free()) return {};
  const Vector6 jump = inputs->root_twist - state->velocity.head<6>();
  if (jump.cwiseAbs().maxCoeff() <= kSameTwist * (1.0 + inputs->root_twist.norm())) return {};
  if (const EvaluationFailure failure = EvaluateForces(plant, *state, *inputs, work)) {
    return failure;
  }
  const Vector6 acceleration = inputs->root_acceleration;
  inputs->root_acceleration = jump;
  work->force.setZero();
  SolveAcceleration(plant, *inputs, work, &work->flat);
  inputs->root_acceleration = acceleration;
  state->velocity += work->flat;
  ImposeRoot(plant, *inputs, state);
  return EvaluateForces(plant, *state, *inputs, work);
}

PlantWork::PlantWork(const Plant& plant)
    : force(VectorX::Zero(plant.velocity_size())),
      shell(plant.shell ? plant.shell->element_count() : 0),
      volume_gradient(plant.shape_count(), Vector3::Zero()),
      cable_length_m(plant.cable_count(), 0.0),
      cable_rate_m_s(plant.cable_count(), 0.0),
      cable_tension_n(plant.cable_count(), 0.0),
      scratch(plant.shape_count(), Vector3::Zero()),
      gradient_scratch(plant.shape_count(), Vector3::Zero()),
      flat(VectorX::Zero(plant.velocity_size())) {
  for (const Rod& r : plant.rods) {
    twist.emplace_back(r.nodes.size(), Vector6::Zero());
    rod.emplace_back(r.elements.size());
    middle.emplace_back(r.elements.size());
    mass.emplace_back(static_cast<int>(r.nodes.size()));
    mass_rhs.push_back(VectorX::Zero(6 * static_cast<int>(r.nodes.size())));
    muscles.emplace_back(r.muscles.empty() ? 0 : r.elements.size(), Vector3::Zero());
    payloads.insert(payloads.end(), r.payloads.size(), 1.0);
  }
}

Matrix6 PayloadInertia(const Plant& plant, const PlantWork& work, int arm, int node) {
  Matrix6 sum = Matrix6::Zero();
  const std::vector<RodPayload>& payloads = plant.rods[arm].payloads;
  for (std::size_t k = 0; k < payloads.size(); ++k) {
    if (payloads[k].node != node) continue;
    sum += work.payloads[plant.PayloadIndex(arm, static_cast<int>(k))] * payloads[k].inertia;
  }
  return sum;
}

ShellMotion MantleMotionOf(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                           const PlantWork& work) {
  return {*plant.shell,
          state.shape,
          state.velocity.data() + plant.ShellVelocity(0),
          {state.pose[0].rotation, state.velocity.head<6>(), inputs.water_acceleration_m_s2},
          plant.exact(),
          inputs.normal_pressure_pa,
          inputs.gravity_scale,
          work.volume_rate_m3_s,
          work.radial_flux_m3_s,
          work.max_radius_m,
          work.mean_axial_speed_m_s,
          work.mantle_inertia};
}

Pose AbsolutePose(const Plant& plant, const PlantState& state, int arm, int node) {
  const Pose& g = state.pose[plant.ArmPose(arm, node)];
  return plant.exact() ? g : state.pose[0] * g;
}

Vector6 AbsoluteTwist(const Plant& plant, const PlantState& state, int arm, int node) {
  const Vector6 root = state.velocity.head<6>();
  if (node == 0) return AdjointInverseTimes(plant.rods[arm].mount, root);
  const Vector6 v = state.velocity.segment<6>(plant.ArmVelocity(arm, node));
  if (plant.exact()) return v;
  return v + AdjointInverseTimes(state.pose[plant.ArmPose(arm, node)], root);
}

PlaceMotion AbsoluteMiddle(const Plant& plant, const PlantState& state, int arm, int element) {
  const RodNode& place = plant.rods[arm].middles[element];
  const Pose g1 = AbsolutePose(plant, state, arm, element);
  const RodMiddle m = MiddleOf(Inverse(g1) * AbsolutePose(plant, state, arm, element + 1));
  return {MiddlePose(place, m, g1), MiddleTwist(place, m, AbsoluteTwist(plant, state, arm, element),
                                                AbsoluteTwist(plant, state, arm, element + 1))};
}

}  // namespace mantle::model
