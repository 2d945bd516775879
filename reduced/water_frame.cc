#include "reduced/water_frame.h"

namespace mantle::reduced {

using model::Hat;
using model::Matrix3;
using model::WaterMotion;

void ToEarth(const WaterMotion& water, ReducedState* state) {
  state->root.position += water.drift_m;
  state->v.segment<3>(3) += state->root.rotation.conjugate() * water.velocity_m_s;
}

void ToWater(const WaterMotion& water, ReducedState* state) {
  state->root.position -= water.drift_m;
  state->v.segment<3>(3) -= state->root.rotation.conjugate() * water.velocity_m_s;
}

void SupportToWater(const Vector3& c_m_s, model::PlantInputs* inputs) {
  const Vector3 b = inputs->root_pose.rotation.conjugate() * c_m_s;
  inputs->root_acceleration.tail<3>() += inputs->root_twist.head<3>().cross(b);  // -d(R^T c)/dt
  inputs->root_twist.tail<3>() -= b;
}

CurrentStep::CurrentStep(const ReducedModel& model) : model_(model), from_(InitialState(model)) {}

StepOutcome CurrentStep::Take(const StepSettings& settings, double h, const ReducedState& from,
                              const model::PlantInputs& first, const model::PlantInputs& last,
                              const Vector3& c_m_s, StepWork* work, ReducedState* to,
                              StepJacobian* jacobian, Eigen::MatrixXd* by_current) {
  const bool free = model_.root_free();
  WaterMotion water;  // the frames coincide at the start
  water.velocity_m_s = c_m_s;
  from_ = from;
  ToWater(water, &from_);
  if (!free) {
    first_ = first;
    last_ = last;
    SupportToWater(c_m_s, &first_);
    SupportToWater(c_m_s, &last_);
  }
  const StepOutcome outcome = TakeStep(model_, settings, h, from_, free ? first : first_,
                                       free ? last : last_, work, to, jacobian);
  if (!outcome.ok) return outcome;
  if (free) water.drift_m = h * c_m_s;  // a held root's place is the earth's already
  ToEarth(water, to);
  if (jacobian != nullptr) JacobianToEarth(h, from, *to, c_m_s, jacobian, by_current);
  return outcome;
}

void CurrentStep::JacobianToEarth(double h, const ReducedState& from, const ReducedState& to,
                                  const Vector3& c_m_s, StepJacobian* jacobian,
                                  Eigen::MatrixXd* by_current) const {
  const int n = model_.velocity_count(), v = n + 3;
  const Matrix3 start = from.root.rotation.conjugate().toRotationMatrix();
  const Matrix3 end = to.root.rotation.conjugate().toRotationMatrix();
  if (!model_.root_free()) {  // its motion is given, the shape's derivatives are the same
    if (by_current == nullptr) return;
    by_current->noalias() = -jacobian->support.rightCols<3>() * end;
    by_current->topRows<6>().setZero();
    by_current->middleRows<6>(n).setZero();
    return;
  }
  const Matrix3 turned = Hat(end * c_m_s);
  const auto at_end = [&](auto& rows) {
    rows.template middleRows<3>(v).noalias() += turned * rows.template topRows<3>();
  };
  if (by_current != nullptr) by_current->noalias() = -jacobian->state.middleCols<3>(v) * start;
  jacobian->state.leftCols<3>() -= jacobian->state.middleCols<3>(v) * Hat(start * c_m_s);
  at_end(jacobian->state);
  at_end(jacobian->input);
  at_end(jacobian->step);
  jacobian->step.segment<3>(3) += end * c_m_s;
  if (by_current == nullptr) return;
  at_end(*by_current);
  by_current->middleRows<3>(3) += h * end;
  by_current->middleRows<3>(v) += end;
}

}  // namespace mantle::reduced
