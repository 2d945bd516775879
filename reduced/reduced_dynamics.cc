#include <Eigen/Cholesky>
#include <limits>

#include "reduced/reduced_model.h"

namespace mantle::reduced {
namespace {

using model::CoadjointTimes;
using model::PlantInputs;
using Kind = ActuatorTarget::Kind;

ArmMotion MotionOf(const ReducedModel& model, int a, const ReducedState& state,
                   const VectorX& acceleration, const PlantInputs& inputs) {
  int distributed = 0, points = 0, muscles = 0, payloads = 0;
  for (int b = 0; b < a; ++b) {
    muscles += static_cast<int>(model.arms[b].muscles.size());
    payloads += static_cast<int>(model.arms[b].payloads.size());
    distributed += static_cast<int>(model.arms[b].distributed.size());
    points += static_cast<int>(model.arms[b].points.size());
  }
  const int first = model.arm_first(a);
  return {state.q.data() + first,
          state.v.data() + 6 + first,
          acceleration.data() + 6 + first,
          state.v.head<6>(),
          acceleration.head<6>(),
          state.root.rotation,
          inputs.gravity_scale,
          inputs.cables.data() + model.ArmCableIndex(a, 0),
          inputs.distributed.data() + distributed,
          inputs.points.data() + points,
          inputs.muscles.data() + muscles,
          inputs.envelopes.data(),
          inputs.payloads.data() + payloads,
          inputs.water_acceleration_m_s2};
}

MantleMotion MotionOf(const ReducedModel& model, const ReducedState& state,
                      const VectorX& acceleration, const PlantInputs& inputs) {
  const int first = model.mantle_first();
  return {state.q.data() + first,
          state.v.data() + 6 + first,
          acceleration.data() + 6 + first,
          state.v.head<6>(),
          acceleration.head<6>(),
          state.root.rotation,
          inputs.gravity_scale,
          inputs.cables.data() + model.SpokeIndex(0),
          inputs.strips_pa.data(),
          inputs.normal_pressure_pa,
          inputs.water_acceleration_m_s2};
}

// Rigid body and what acts on the root alone.
Vector6 RootResidual(const ReducedModel& model, const ReducedState& state,
                     const VectorX& acceleration, const PlantInputs& inputs) {
  const Vector6 eta = state.v.head<6>();
  Vector6 r =
      model.rigid_inertia * acceleration.head<6>() - CoadjointTimes(eta, model.rigid_inertia * eta);
  AddRootWrenches(model.root_loads, {state.root.rotation, eta, inputs.water_acceleration_m_s2},
                  inputs.gravity_scale, -1.0, &r);
  return r;
}

void LineariseRoot(const ReducedModel& model, const ReducedState& state, const PlantInputs& inputs,
                   ReducedJacobians* out) {
  const Vector6 eta = state.v.head<6>();
  out->mass.topLeftCorner<6, 6>() += model.rigid_inertia;
  auto damping = out->damping.topLeftCorner<6, 6>();
  damping -= model::CoadjointMatrix(model.rigid_inertia * eta);
  damping -= model::SmallAdjoint(eta).transpose() * model.rigid_inertia;
  const model::RootTangent loads =
      RootLoadTangent(model.root_loads, {state.root.rotation, eta, inputs.water_acceleration_m_s2},
                      inputs.gravity_scale);
  out->stiffness.topLeftCorner<6, 3>() -= loads.by_rotation;
  damping -= loads.by_twist;
}

void AddCableColumn(const ReducedModel& model, const ReducedState& state,
                    const VectorX& acceleration, const PlantInputs& inputs, ReducedWork* work,
                    int cable, double gain, Eigen::Ref<VectorX> column) {
  const model::CableInput& in = inputs.cables[cable];
  const auto by_input = [&](double tension) {  // d tension / d input
    if (!in.reeled) return 1.0;
    return tension > 0.0 ? -in.stiffness_n_m : 0.0;
  };
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    const int count = static_cast<int>(model.arms[a].cables.size());
    const int c = cable - model.ArmCableIndex(a, 0);
    if (c < 0 || c >= count) continue;
    if (!in.reeled && in.tension_n == 0.0) {
      const ArmMotion m = MotionOf(model, a, state, acceleration, inputs);
      EvaluateCable(model.arms[a], m, c, &work->arms[a]);
    }
    column.segment(6 + model.arm_first(a), model.arms[a].size()) +=
        gain * by_input(work->arms[a].cable_tension_n[c]) * work->arms[a].cable_gradient[c];
    return;
  }
  const int k = cable - model.SpokeIndex(0);
  column.segment(6 + model.mantle_first(), model.mantle->size) +=
      gain * by_input(work->mantle[0].cable_tension_n[k]) * model.mantle->spokes[k].gradient;
}

void AddInputColumn(const ReducedModel& model, const ReducedState& state,
                    const VectorX& acceleration, const PlantInputs& inputs, ReducedWork* work,
                    const ActuatorTarget& t, Eigen::Ref<VectorX> column) {
  switch (t.kind) {
    case Kind::kCable:
      AddCableColumn(model, state, acceleration, inputs, work, t.index, t.gain, column);
      return;
    case Kind::kDistributed:
    case Kind::kPoint: {
      int index = t.index;
      for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
        const ReducedArm& arm = model.arms[a];
        const int count =
            static_cast<int>(t.kind == Kind::kPoint ? arm.points.size() : arm.distributed.size());
        if (index >= count) {
          index -= count;
          continue;
        }
        const ArmMotion m = MotionOf(model, a, state, acceleration, inputs);
        const auto add = t.kind == Kind::kPoint ? AddPointColumn : AddDistributedColumn;
        add(arm, m, work->arms[a], index, t.gain, 6 + model.arm_first(a), column);
        return;
      }
      return;
    }
    case Kind::kStrip:
      column.segment(6 + model.mantle_first(), model.mantle->size) +=
          t.gain * model.mantle->strips[t.index];
      return;
    case Kind::kNormalPressure:
      column.segment(6 + model.mantle_first(), model.mantle->size) -=
          t.gain * work->mantle[0].values.value.segment(model.mantle->wall, model.mantle->size);
      return;
  }
}

}  // namespace

ReducedFailure EvaluateResidual(const ReducedModel& model, const ReducedState& state,
                                const VectorX& acceleration, const PlantInputs& inputs,
                                ReducedWork* work) {
  work->residual.head<6>() = RootResidual(model, state, acceleration, inputs);
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    const ArmMotion m = MotionOf(model, a, state, acceleration, inputs);
    if (!EvaluateArm(model.arms[a], m, &work->arms[a])) {
      return {model.robot.arms[a].name.c_str(), -1, "a force or a pose is not finite",
              work->arms[a].base_wrench.norm(), std::numeric_limits<double>::max()};
    }
    for (int l = 0; l < model.arms[a].dynamic_intervals; ++l) {
      const double stretch = work->arms[a].at[l].omega(3) / model.arms[a].intervals[l].length_m;
      if (!(stretch > 0.0)) {
        return {model.robot.arms[a].name.c_str(),
                l,
                "stretch along the arm: the material is turned inside out",
                stretch,
                0.0,
                "interval"};
      }
    }
    work->residual.head<6>() += work->arms[a].base_wrench;
    work->residual.segment(6 + model.arm_first(a), model.arms[a].size()) = work->arms[a].residual;
  }
  if (model.mantle) {
    const MantleMotion m = MotionOf(model, state, acceleration, inputs);
    if (ReducedFailure failure = EvaluateMantle(*model.mantle, m, &work->mantle[0])) {
      failure.body = model.robot.mantle->name.c_str();
      return failure;
    }
    work->residual.head<6>() += work->mantle[0].root_wrench;
    work->residual.tail(model.mantle->size) = work->mantle[0].residual;
  }
  if (!work->residual.allFinite()) {
    return {model.robot.name.c_str(), -1, "a force on the root is not finite",
            work->residual.norm(), std::numeric_limits<double>::max()};
  }
  return {};
}

void Linearise(const ReducedModel& model, const ReducedState& state, const VectorX& acceleration,
               const PlantInputs& inputs, bool with_inputs, ReducedWork* work,
               ReducedJacobians* out) {
  for (Eigen::MatrixXd* m : {&out->mass, &out->damping, &out->stiffness}) m->setZero();
  LineariseRoot(model, state, inputs, out);
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    const ArmMotion m = MotionOf(model, a, state, acceleration, inputs);
    LineariseArm(model.arms[a], m, 6 + model.arm_first(a), &work->arms[a], out);
  }
  if (model.mantle) {
    const MantleMotion m = MotionOf(model, state, acceleration, inputs);
    LineariseMantle(*model.mantle, m, 6 + model.mantle_first(), &work->mantle[0], out);
  }
  if (!with_inputs) return;
  out->input.setZero();
  for (int i = 0; i < model.input_count(); ++i) {
    for (const ActuatorTarget& t : model.actuators[i].targets) {
      AddInputColumn(model, state, acceleration, inputs, work, t, out->input.col(i));
    }
  }
}

ReducedFailure SolveAcceleration(const ReducedModel& model, const ReducedState& state,
                                 const PlantInputs& inputs, ReducedWork* work,
                                 ReducedJacobians* jacobians, VectorX* acceleration) {
  acceleration->setZero(model.velocity_count());
  if (!model.root_free()) acceleration->head<6>() = inputs.root_acceleration;
  if (const ReducedFailure failure = EvaluateResidual(model, state, *acceleration, inputs, work)) {
    return failure;
  }
  Linearise(model, state, *acceleration, inputs, false, work, jacobians);
  const int skip = model.root_free() ? 0 : 6;
  const int n = model.velocity_count() - skip;
  acceleration->tail(n) -=
      jacobians->mass.bottomRightCorner(n, n).ldlt().solve(work->residual.tail(n));
  return {};
}

ReducedFailure CrossRootKink(const ReducedModel& model, const PlantInputs& inputs,
                             ReducedWork* work, ReducedJacobians* jacobians, ReducedState* state) {
  if (model.root_free()) return {};
  const Vector6 jump = inputs.root_twist - state->v.head<6>();
  if (jump.isZero(0.0)) return {};
  const VectorX at_rest = VectorX::Zero(model.velocity_count());
  if (const ReducedFailure failure = EvaluateResidual(model, *state, at_rest, inputs, work)) {
    return failure;
  }
  Linearise(model, *state, at_rest, inputs, false, work, jacobians);
  const int n = model.coordinate_count();
  const Eigen::MatrixXd& mass = jacobians->mass;
  state->v.tail(n) -=
      mass.bottomRightCorner(n, n).ldlt().solve(mass.bottomLeftCorner(n, 6).lazyProduct(jump));
  state->v.head<6>() = inputs.root_twist;
  return {};
}

}  // namespace mantle::reduced
