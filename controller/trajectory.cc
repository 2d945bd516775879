#include "controller/trajectory.h"

#include "model/root_motion.h"

namespace mantle::controller {
namespace {

constexpr int kMostHalvings = 4;

void SetSupport(const model::Robot& robot, double t_s, model::PlantInputs* inputs) {
  const model::RootKinematics root = EvaluateRootMotion(robot, t_s);
  inputs->root_pose = root.pose;
  inputs->root_twist = root.twist;
  inputs->root_acceleration = root.acceleration;
}

}  // namespace

Trajectory::Trajectory(const ReducedModel& model, const Horizon& horizon)
    : states(horizon.time_s.size(), InitialState(model)),
      tensions(Eigen::MatrixXd::Zero(model.input_count(), horizon.steps() + 1)),
      jacobians(horizon.steps(), reduced::StepJacobian(model)) {}

Propagator::Propagator(const ReducedModel& model, const reduced::StepSettings& settings)
    : model_(model),
      settings_(settings),
      work_(model),
      in_current_(model),
      disturbance_(model.input_count()),
      mean_(VectorX::Zero(model.input_count())),
      middle_(kMostHalvings + 1, InitialState(model)),
      part_(kMostHalvings + 1, reduced::StepJacobian(model)),
      product_(2 * model.velocity_count(), 2 * model.velocity_count()),
      part_by_current_(kMostHalvings + 1, Eigen::MatrixXd(2 * model.velocity_count(), 3)) {
  EvaluateInputs(model, 0.0, false, &inputs_);
  last_ = inputs_;
}

reduced::StepOutcome Propagator::Step(const ReducedState& from, double h,
                                      const Eigen::Ref<const VectorX>& tensions, ReducedState* to,
                                      reduced::StepJacobian* jacobian,
                                      Eigen::MatrixXd* by_current) {
  EvaluateInputs(model_, from.time_s + 0.5 * h, false, &inputs_);
  disturbed_ = tensions + disturbance_.bias_n;
  ApplyControls(model_, disturbed_.data(), &inputs_);
  const reduced::StepOutcome outcome = Divided(from, h, 0, to, jacobian, by_current);
  if (outcome.ok && model_.root_free()) {
    to->v.segment<3>(3) += h * disturbance_.acceleration_m_s2;
  }
  return outcome;
}

// One step of the scheme, by its motion at the stages where the root is moved.
reduced::StepOutcome Propagator::Whole(const ReducedState& from, double h, ReducedState* to,
                                       reduced::StepJacobian* jacobian,
                                       Eigen::MatrixXd* by_current) {
  const model::Vector3& current = disturbance_.current_m_s;
  const model::PlantInputs* last = &inputs_;
  if (std::holds_alternative<model::PrescribedRoot>(model_.robot.root)) {
    last_ = inputs_;
    last = &last_;
    SetSupport(model_.robot, from.time_s + h * reduced::FirstStageTime(settings_.scheme), &inputs_);
    SetSupport(model_.robot, from.time_s + h, &last_);
  }
  if (by_current == nullptr && current.isZero(0.0)) {
    return TakeStep(model_, settings_, h, from, inputs_, *last, &work_, to, jacobian);
  }
  return in_current_.Take(settings_, h, from, inputs_, *last, current, &work_, to, jacobian,
                          by_current);
}

reduced::StepOutcome Propagator::Divided(const ReducedState& from, double h, int depth,
                                         ReducedState* to, reduced::StepJacobian* jacobian,
                                         Eigen::MatrixXd* by_current) {
  const reduced::StepOutcome outcome = Whole(from, h, to, jacobian, by_current);
  if (outcome.ok || depth == kMostHalvings) return outcome;
  ReducedState& middle = middle_[depth];
  reduced::StepJacobian* first = jacobian == nullptr ? nullptr : &part_[depth];
  reduced::StepOutcome half = Divided(from, 0.5 * h, depth + 1, &middle, first, by_current);
  if (half.ok && by_current != nullptr) part_by_current_[depth] = *by_current;
  if (half.ok) half = Divided(middle, 0.5 * h, depth + 1, to, jacobian, by_current);
  if (half.ok && by_current != nullptr) {
    by_current->noalias() += jacobian->state * part_by_current_[depth];
  }
  if (half.ok && jacobian != nullptr) {
    product_.noalias() = jacobian->state * first->state;
    jacobian->input += jacobian->state * first->input;
    jacobian->step = 0.5 * (jacobian->step + jacobian->state * first->step);
    jacobian->state = product_;
  }
  return half;
}

reduced::StepOutcome Propagator::Roll(const Horizon& horizon, bool with_jacobians, Trajectory* t) {
  for (int k = 0; k < horizon.steps(); ++k) {
    mean_ = 0.5 * (t->tensions.col(k) + t->tensions.col(k + 1));
    const reduced::StepOutcome outcome =
        Step(t->states[k], horizon.step(k), mean_, &t->states[k + 1],
             with_jacobians ? &t->jacobians[k] : nullptr);
    if (!outcome.ok) return outcome;
    t->states[k + 1].time_s = t->states[0].time_s + horizon.time_s[k + 1];
  }
  return {};
}

}  // namespace mantle::controller
