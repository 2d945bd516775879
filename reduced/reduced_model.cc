#include "reduced/reduced_model.h"

#include <fmt/format.h>

namespace mantle::reduced {
namespace {

using Kind = ActuatorTarget::Kind;

double* InputOf(const ActuatorTarget& target, model::PlantInputs* inputs) {
  switch (target.kind) {
    case Kind::kCable: {
      model::CableInput& cable = inputs->cables[target.index];
      return cable.reeled ? &cable.reel_m : &cable.tension_n;
    }
    case Kind::kDistributed:
      return &inputs->distributed[target.index];
    case Kind::kPoint:
      return &inputs->points[target.index];
    case Kind::kStrip:
      return &inputs->strips_pa[target.index];
    case Kind::kNormalPressure:
      return &inputs->normal_pressure_pa;
  }
  return nullptr;
}

}  // namespace

ReducedState InitialState(const ReducedModel& model) { return model.start; }

void EvaluateInputs(const ReducedModel& model, double t_s, bool from_left,
                    model::PlantInputs* inputs) {
  EvaluateInputs(model.robot, model.cable_rest_m, t_s, from_left, inputs);
}

std::string SizeComplaint(const ReducedModel& model, const ReducedState& state) {
  const auto complaint = [](const char* name, long have, int want) {
    return fmt::format("{} has {} entries, must be {}", name, have, want);
  };
  if (state.q.size() != model.coordinate_count()) {
    return complaint("q", state.q.size(), model.coordinate_count());
  }
  if (state.v.size() != model.velocity_count()) {
    return complaint("v", state.v.size(), model.velocity_count());
  }
  return {};
}

void ApplyControls(const ReducedModel& model, const double* u, model::PlantInputs* inputs) {
  for (const Actuator& actuator : model.actuators) {
    for (const ActuatorTarget& t : actuator.targets) {
      *InputOf(t, inputs) = 0.0;
      if (t.kind == Kind::kCable) inputs->cables[t.index].reel_rate_m_s = 0.0;
    }
  }
  for (const Actuator& actuator : model.actuators) {
    for (const ActuatorTarget& t : actuator.targets) *InputOf(t, inputs) += t.gain * *u;
    ++u;
  }
}

ReducedWork::ReducedWork(const ReducedModel& model)
    : residual(VectorX::Zero(model.velocity_count())) {
  for (const ReducedArm& arm : model.arms) arms.emplace_back(arm);
  if (model.mantle) mantle.emplace_back(*model.mantle);
}

ReducedJacobians::ReducedJacobians(const ReducedModel& model) {
  const int n = model.velocity_count();
  for (Eigen::MatrixXd* m : {&mass, &damping, &stiffness}) m->setZero(n, n);
  input.setZero(n, model.input_count());
}

}  // namespace mantle::reduced
