#include <algorithm>
#include <cmath>

#include "model/plant.h"

namespace mantle::model {
namespace {

EvaluationFailure EvaluateRod(const Plant& plant, int a, const PlantState& state,
                              const PlantInputs& inputs, PlantWork* work) {
  const Rod& rod = plant.rods[a];
  std::vector<Vector6>& twist = work->twist[a];
  std::vector<RodElementState>& elements = work->rod[a];
  const int n = rod.element_count();
  const Pose* pose = &state.pose[plant.ArmPose(a, 0)];
  twist[0] = plant.exact() ? AdjointInverseTimes(rod.mount, state.velocity.head<6>())
                           : Vector6(Vector6::Zero());
  for (int i = 1; i <= n; ++i) twist[i] = state.velocity.segment<6>(plant.ArmVelocity(a, i));
  for (int i = 0; i < n; ++i) {
    if (!EvaluateRodElement(pose[i], pose[i + 1], twist[i], twist[i + 1], &elements[i])) {
      return {rod.name.c_str(),
              i,
              "rotation across one element [rad] too large or not finite",
              elements[i].d.head<3>().norm(),
              kMaxElementRotation,
              "element",
              "the mesh is too coarse for this shape: raise the arm's `elements`"};
    }
    if (!(elements[i].d(3) > 0.0)) {
      return {rod.name.c_str(), i, "stretch along the arm: the material is turned inside out",
              elements[i].d(3) / rod.elements[i].length, 0.0};
    }
  }
  for (int i = 0; i < n; ++i) {
    const RodMiddle& m = elements[i].middle;
    MiddleState& at = work->middle[a][i];
    at.tau_rate = MiddleTauRate(m, twist[i], twist[i + 1]);
    const Vector6 bias = 0.5 * SmallAdjointTimes(at.tau_rate, twist[i + 1] - twist[i]);
    at.bias = TwistAhead(rod.middles[i].ahead_m, bias);
    at.twist = MiddleTwist(rod.middles[i], m, twist[i], twist[i + 1]);
  }
  for (std::size_t c = 0; c < rod.cables.size(); ++c) {
    const int index = plant.ArmCableIndex(a, static_cast<int>(c));
    double length = 0, rate = 0;
    Vector6 gradient;
    for (std::size_t i = 0; i < rod.cables[c].pieces.size(); ++i) {
      length += CablePieceLength(rod.cables[c].pieces[i], rod.elements[i], elements[i].d, &gradient,
                                 nullptr);
      rate += gradient.dot(elements[i].d_dot);
    }
    work->cable_length_m[index] = length;
    work->cable_rate_m_s[index] = rate;
    work->cable_tension_n[index] = CableTension(inputs.cables[index], length, rate);
  }
  if (rod.muscles.empty()) return {};
  for (int i = 0; i < n; ++i) {
    Vector3& moment = work->muscles[a][i];
    moment.setZero();
    for (std::size_t k = 0; k < rod.muscles.size(); ++k) {
      moment += MeanMuscleMoment(rod.muscles[k].wave,
                                 inputs.muscles[plant.MuscleIndex(a, static_cast<int>(k))],
                                 inputs.envelopes.data(), rod.x_m[i], rod.x_m[i + 1]);
    }
  }
  return {};
}

double AttachedOf(const Plant& plant, int a, const RodPayload& p, const PlantWork& work) {
  const auto k = &p - plant.rods[a].payloads.data();
  return work.payloads[plant.PayloadIndex(a, static_cast<int>(k))];
}

// On a place of an arm: loads from outside, the wrenches of actuators, and of these the internal
// ones, whose reaction the root carries.
struct PlaceLoads {
  Vector6 external{Vector6::Zero()}, actuation{Vector6::Zero()}, internal{Vector6::Zero()};
};

// Loads per unit length times the place's share of length.
PlaceLoads EvaluateLoads(const Rod& rod, const RodNode& at, const SectionMotion& motion,
                         const PlantInputs& inputs, int first_distributed) {
  PlaceLoads out;
  for (const SectionLoad& load : rod.loads) {
    const double scale = at.weight_m * FieldScale(load, inputs.gravity_scale);
    out.external +=
        scale * std::visit([&](const auto& l) { return l.Density(at.section, motion); }, load);
  }
  for (std::size_t k = 0; k < rod.distributed.size(); ++k) {
    const double amplitude = inputs.distributed[first_distributed + k];
    if (amplitude == 0.0) continue;
    const Vector6 w =
        (at.weight_m * amplitude) * rod.distributed[k].load.Density(at.section, motion);
    out.actuation += w;
    if (IsInternal(rod.distributed[k].load)) out.internal += w;
  }
  return out;
}

void AddRodForces(const Plant& plant, int a, const PlantState& state, const PlantInputs& inputs,
                  int first_distributed, int first_point, PlantWork* work) {
  const Rod& rod = plant.rods[a];
  const std::vector<Vector6>& twist = work->twist[a];
  const std::vector<RodElementState>& elements = work->rod[a];
  const int n = rod.element_count();
  const Pose* pose = &state.pose[plant.ArmPose(a, 0)];
  const Vector6 root_twist = state.velocity.head<6>();
  Vector6 base = Vector6::Zero();  // on node 0, in the base frame
  const auto at = [&](int i) { return work->force.segment<6>(plant.ArmVelocity(a, i)); };

  for (int i = 0; i < n; ++i) {
    Vector6 sigma = RodStress(rod.elements[i], elements[i]);
    AddCoupledStress(rod, i, elements[i], work->muscles[a], &sigma);
    for (std::size_t c = 0; c < rod.cables.size(); ++c) {
      if (i >= static_cast<int>(rod.cables[c].pieces.size())) continue;
      const double u = work->cable_tension_n[plant.ArmCableIndex(a, static_cast<int>(c))];
      if (u == 0.0) continue;
      Vector6 gradient;
      CablePieceLength(rod.cables[c].pieces[i], rod.elements[i], elements[i].d, &gradient, nullptr);
      sigma += u * gradient;
    }
    Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
    AddRodElementForces(elements[i], sigma, &f1, &f2);
    if (i == 0) {
      base += f1;
    } else {
      at(i) += f1;
    }
    at(i + 1) += f2;
  }
  for (int i = 1; i <= n; ++i) {
    at(i) += CoadjointTimes(twist[i], rod.nodes[i].FullInertia().cwiseProduct(twist[i]));
  }
  for (const RodPayload& p : rod.payloads) {  // on node 0 it is in the root's momentum
    if (p.node == 0) continue;
    const double attached = AttachedOf(plant, a, p, *work);
    at(p.node) += attached * CoadjointTimes(twist[p.node], p.inertia * twist[p.node]);
  }

  Vector6 root_loads = Vector6::Zero();  // frozen coupling: external loads, about the root
  // Exact coupling: the internal loads, about the root's origin in the world's axes.
  Vector3 internal_moment = Vector3::Zero(), internal_force = Vector3::Zero();
  const auto loads_on = [&](const RodNode& place, const Pose& g, const Vector6& eta,
                            SectionMotion* motion) {
    *motion = {g.rotation, eta, inputs.water_acceleration_m_s2};
    if (!plant.exact()) {
      motion->rotation = state.pose[0].rotation * g.rotation;
      motion->twist += AdjointInverseTimes(g, root_twist);
    }
    const PlaceLoads loads = EvaluateLoads(rod, place, *motion, inputs, first_distributed);
    if (plant.exact() && !loads.internal.isZero(0.0)) {
      const Vector3 force = g.rotation * loads.internal.tail<3>();
      internal_force += force;
      internal_moment += g.rotation * loads.internal.head<3>() +
                         (g.position - state.pose[0].position).cross(force);
    }
    return loads;
  };
  SectionMotion motion;
  for (int i = 0; i <= n; ++i) {
    PlaceLoads loads = loads_on(rod.nodes[i], pose[i], twist[i], &motion);
    for (std::size_t k = 0; k < rod.points.size(); ++k) {
      if (rod.points[k].node != i) continue;
      loads.external += WrenchInSection(inputs.points[first_point + k] * rod.points[k].load.wrench,
                                        rod.points[k].load.frame, motion.rotation);
    }
    for (const RodPayload& p : rod.payloads) {
      if (p.node != i) continue;
      const double attached = AttachedOf(plant, a, p, *work);
      AddRootWrenches(p.loads, motion, inputs.gravity_scale, attached, &loads.external);
    }
    if (i > 0) {
      at(i) += loads.external + loads.actuation;
    } else {
      base += loads.external + loads.actuation;
    }
    if (!plant.exact()) {
      root_loads +=
          AdjointInverseTransposeTimes(pose[i], loads.external + loads.actuation - loads.internal);
    }
  }
  for (int i = 0; i < n; ++i) {
    const RodNode& place = rod.middles[i];
    MiddleState& middle = work->middle[a][i];
    const Pose g = MiddlePose(place, elements[i].middle, pose[i]);
    const PlaceLoads loads = loads_on(place, g, middle.twist, &motion);
    const Vector6 inertia = place.FullInertia();
    middle.wrench = loads.external + loads.actuation - inertia.cwiseProduct(middle.bias) +
                    CoadjointTimes(middle.twist, inertia.cwiseProduct(middle.twist));
    Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
    AddMiddleWrench(place, elements[i].middle, middle.wrench, &f1, &f2);
    if (i == 0) {
      base += f1;
    } else {
      at(i) += f1;
    }
    at(i + 1) += f2;
    if (!plant.exact()) {
      root_loads +=
          AdjointInverseTransposeTimes(g, loads.external + loads.actuation - loads.internal);
    }
  }
  if (!plant.exact()) {
    work->force.head<6>() += root_loads;
    return;
  }
  work->force.head<6>() += AdjointInverseTransposeTimes(rod.mount, base);
  if (internal_force.isZero(0.0) && internal_moment.isZero(0.0)) return;
  const Eigen::Quaterniond to_root = state.pose[0].rotation.conjugate();  // their reaction
  work->force.head<3>() -= to_root * internal_moment;
  work->force.segment<3>(3) -= to_root * internal_force;
}

EvaluationFailure AddShellForces(const Plant& plant, const PlantState& state,
                                 const PlantInputs& inputs, PlantWork* work) {
  const Shell& shell = *plant.shell;
  const Effects& effects = plant.robot.effects;
  const int n = shell.element_count();
  const std::vector<Vector3>& q = state.shape;
  const Vector6 root = state.velocity.head<6>();
  std::vector<Vector3>& v = work->scratch;
  for (int j = 0; j <= n; ++j) v[j] = state.velocity.segment<3>(plant.ShellVelocity(j));
  Eigen::Map<Eigen::Matrix3Xd> f(work->force.data() + plant.ShellVelocity(0), 3, n + 1);
  auto* nodes = reinterpret_cast<Vector3*>(f.data());

  work->max_radius_m = 0;
  for (int j = 0; j <= n; ++j) {
    if (!(q[j](0) > 0.0) && shell.reference[j](0) > 0.0) {
      return {shell.name.c_str(), j, "radius [m] of the mantle closed up", q[j](0), 0.0};
    }
    work->max_radius_m = std::max(work->max_radius_m, q[j](0));
  }
  for (int i = 0; i < n; ++i) {
    EvaluateShellElement(shell.elements[i], shell.material, q[i], q[i + 1], v[i], v[i + 1],
                         &work->shell[i]);
    if (!(work->shell[i].lambda > 0.0)) {
      return {shell.name.c_str(), i,
              "stretch along the meridian: the material is turned inside out",
              work->shell[i].lambda, 0.0};
    }
    AddShellElementForces(shell.elements[i], work->shell[i], &nodes[i], &nodes[i + 1]);
  }
  for (std::size_t k = 0; k < shell.strips.size(); ++k) {
    for (int j = 0; j <= n; ++j) {
      f(0, j) -= inputs.strips_pa[k] * shell.strips[k].strip.area_m2[j];
    }
  }
  for (std::size_t k = 0; k < shell.spokes.size(); ++k) {
    const ShellSpokes& s = shell.spokes[k];
    const int index = plant.SpokeIndex(static_cast<int>(k));
    double length = 0, rate = 0;
    for (int j = 0; j <= n; ++j) {
      const double w = s.spokes * s.strip.area_m2[j] / s.strip.total_m2;
      length += w * q[j](0);
      rate += w * v[j](0);
    }
    work->cable_length_m[index] = length;
    work->cable_rate_m_s[index] = rate;
    const double u = work->cable_tension_n[index] =
        CableTension(inputs.cables[index], length, rate);
    for (int j = 0; j <= n; ++j) {
      f(0, j) -= u * s.spokes * s.strip.area_m2[j] / s.strip.total_m2;
    }
  }
  work->volume_m3 = ShellVolume(q);
  // A cap held at its rim may snap through; a free lip that has passed the apex is no solid.
  if (!(work->volume_m3 > 0.0) && shell.rest_volume_m3 > 0.0 && shell.nodes[n].held.isZero(0.0)) {
    return {shell.name.c_str(), n, "enclosed volume [m^3]: the mantle is turned inside out",
            work->volume_m3, 0.0};
  }
  ShellVolumeGradient(q, &work->volume_gradient);
  work->volume_rate_m3_s = work->radial_flux_m3_s = 0;
  for (int j = 0; j <= n; ++j) {
    work->volume_rate_m3_s += work->volume_gradient[j].dot(v[j]);
    work->radial_flux_m3_s += work->volume_gradient[j](0) * v[j](0);
  }
  work->mean_axial_speed_m_s = root(5);
  for (int j = 0; j <= n; ++j) {
    work->mean_axial_speed_m_s += shell.nodes[j].area_m2 / shell.area_m2 * v[j](1);
  }
  work->mantle_inertia = EvaluateMantleInertia(shell, plant.water_options, q, v.data());
  const ShellMotion motion = MantleMotionOf(plant, state, inputs, *work);
  ShellForces forces{
      nodes,           work->force.data(),  &work->gradient_scratch, &work->flux_m3_s,
      &work->thrust_n, &work->mantle_drag_n};
  for (const MantleLoad& load : plant.mantle_loads) {
    std::visit([&](const auto& l) { l.AddForces(motion, &forces); }, load);
  }
  if (plant.exact()) {
    if (effects.lateral_added_mass || effects.contained_water) {
      work->cavity = EvaluateCavity(q, v.data());
    }
    AddCentrifugalForces(shell, plant.water_options, work->mantle_inertia, work->cavity, q, root,
                         nodes);
  }
  for (int j : {0, n}) {
    nodes[j] = nodes[j].cwiseProduct(Vector3::Ones() - shell.nodes[j].held);
  }
  return {};
}

void AddRootForces(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                   PlantWork* work) {
  const Vector6 eta = state.velocity.head<6>();
  work->root_mass = plant.root_inertia;
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    if (plant.rods[a].payloads.empty()) continue;
    const Matrix6 ad = Adjoint(Inverse(plant.rods[a].mount));
    work->root_mass += ad.transpose() * PayloadInertia(plant, *work, a, 0) * ad;
  }
  if (plant.shell) AddMantleInertia(work->mantle_inertia, false, &work->root_mass);
  if (!plant.exact()) {
    const auto lock = [&](const RodNode& place, const Pose& g) {
      const Matrix6 ad = Adjoint(Inverse(g));
      work->root_mass += ad.transpose() * place.FullInertia().asDiagonal() * ad;
    };
    for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
      const Rod& rod = plant.rods[a];
      const Pose* pose = &state.pose[plant.ArmPose(a, 0)];
      for (int i = 0; i <= rod.element_count(); ++i) lock(rod.nodes[i], pose[i]);
      for (int i = 0; i < rod.element_count(); ++i) {
        lock(rod.middles[i], MiddlePose(rod.middles[i], work->rod[a][i].middle, pose[i]));
      }
    }
  }
  Vector6 momentum = work->root_mass * eta;
  if (plant.exact() && plant.shell) {
    Matrix6 rate = Matrix6::Zero();
    AddMantleInertia(work->mantle_inertia, true, &rate);
    work->force.head<6>() -= rate * eta;
    momentum(5) += work->mantle_inertia.axial_momentum;
  }
  work->force.head<6>() += CoadjointTimes(eta, momentum);
  Vector6 wrench = work->force.head<6>();
  AddRootWrenches(plant.root_loads, {state.pose[0].rotation, eta, inputs.water_acceleration_m_s2},
                  inputs.gravity_scale, 1.0, &wrench);
  work->force.head<6>() = wrench;
}

}  // namespace

EvaluationFailure EvaluateForces(const Plant& plant, const PlantState& state,
                                 const PlantInputs& inputs, PlantWork* work) {
  work->force.setZero();
  work->payloads = inputs.payloads;
  int distributed = 0, points = 0;
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    if (const EvaluationFailure failure = EvaluateRod(plant, a, state, inputs, work)) {
      return failure;
    }
    AddRodForces(plant, a, state, inputs, distributed, points, work);
    distributed += static_cast<int>(plant.rods[a].distributed.size());
    points += static_cast<int>(plant.rods[a].points.size());
  }
  if (plant.shell) {
    if (const EvaluationFailure failure = AddShellForces(plant, state, inputs, work)) {
      return failure;
    }
  }
  AddRootForces(plant, state, inputs, work);
  if (!work->force.allFinite()) {
    return {plant.robot.name.c_str(), -1, "a force is not finite",
            work->force.cwiseAbs().maxCoeff(), 0.0};
  }
  return {};
}

}  // namespace mantle::model
