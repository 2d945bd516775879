#include <cmath>

#include "reduced/step_solver.h"

namespace mantle::reduced {

void StepSolver::Factor(int i, bool with_inputs) {
  StepWork::Stage& s = work_.stages_[i];
  ReducedJacobians& j = work_.jacobians_;
  Linearise(model_, s.state, s.acceleration, *inputs_[InputIndex(i)], with_inputs,
            &work_.evaluation_, &j);
  work_.weighted_ = j.damping + sigma_ * j.mass;
  work_.matrix_.rightCols(n_ - 6) =
      j.stiffness.rightCols(n_ - 6) + sigma_ * work_.weighted_.rightCols(n_ - 6);
  if (free_) {
    const Vector6 theta = s.y.head<6>();
    const Vector6 twist = s.state.v.head<6>();
    // Jr, and D = d(Jr(theta) x)/d theta = -Jr (d(Jr^-1 y)/d theta) at y = Jr x
    const model::EvenTangentInverse even(theta);
    s.jr = model::TangentOperator(theta);
    s.jr_rate.noalias() = -s.jr * (even.Derivative(twist) - 0.5 * model::SmallAdjoint(twist));
    const Matrix6 by_rate = sigma_ * s.jr + s.jr_rate;
    work_.matrix_.leftCols<6>().noalias() = j.stiffness.leftCols<6>().lazyProduct(s.jr);
    work_.matrix_.leftCols<6>().noalias() += work_.weighted_.leftCols<6>().lazyProduct(by_rate);
  } else {
    work_.matrix_.leftCols<6>().setZero();
    work_.matrix_.topRows<6>().setZero();
    work_.matrix_.topLeftCorner<6, 6>().setIdentity();
  }
  work_.lu_.Factor(work_.matrix_);
}

void StepSolver::Correct(int i) {
  StepWork::Stage& s = work_.stages_[i];
  Factor(i, true);
  VectorX& step = work_.increment_;
  step = -work_.evaluation_.residual;
  if (!free_) step.head<6>().setZero();
  work_.lu_.Solve(&step);
  s.y += step;
  Unpack(i);
}

bool StepSolver::Differentiate(int i) {
  StepWork::Stage& s = work_.stages_[i];
  const ReducedJacobians& j = work_.jacobians_;
  const int inputs = model_.input_count();
  const int at_h = 2 * n_ + inputs;
  const int rest = n_ - 6;
  const double inv_h = 1.0 / h_;
  const double ha = h_ * scheme_.a21;
  const StepWork::Stage& p = work_.stages_[0];
  Panel& x = s.y_by;

  // v_known = v_0 [+ h a21 a_1, a_1 = sigma (v_1 - v_0)]
  const double by_velocity = i > 0 ? sigma_ * (1.0 - sigma_ * ha) : sigma_;
  x.setZero();
  if (free_) {
    x.leftCols<6>() = -j.stiffness.leftCols<6>().lazyProduct(Adjoint(model::Inverse(Moved(s))));
  }
  x.middleCols(6, rest) = -j.stiffness.rightCols(rest);
  x.middleCols(n_, n_) = by_velocity * j.mass;
  x.middleCols(2 * n_, inputs) = -j.input;
  if (!free_) x.middleCols(n_, 6) = -j.damping.leftCols<6>();  // by the support's twist
  // dv = -v/h dh and da = sigma dv - a/h dh at fixed y, y_known, v_known; h a_1 is fixed
  VectorX& column = work_.increment_;
  const auto root_held = [&](VectorX& v) -> VectorX& {
    if (!free_) v.head<6>().setZero();
    return v;
  };
  column = inv_h * s.state.v;
  x.col(at_h) = work_.weighted_.lazyProduct(root_held(column));
  column = inv_h * s.acceleration;
  x.col(at_h) += j.mass.lazyProduct(root_held(column));
  if (i > 0) {
    // y_known = h a21 y_rate_1 and v_known, in their root and other rows (there v = y_rate)
    auto root_rate = work_.right_.topRows<6>();
    root_rate.setZero();
    work_.right_.middleRows<6>(6).setZero();
    if (free_) {
      work_.root_rows_ = ha * p.rate_by.topRows<6>();
      work_.root_rows_.col(at_h) += scheme_.a21 * p.y_rate.head<6>();
      AddProduct(s.jr, work_.root_rows_, root_rate);
      work_.right_.middleRows<6>(6) = p.root;
    }
    work_.right_.bottomRows(rest) = p.rate_by.bottomRows(rest);
    work_.left_.leftCols<6>() = sigma_ * work_.weighted_.leftCols<6>();
    work_.left_.middleCols<6>(6) = (sigma_ * sigma_ * ha) * j.mass.leftCols<6>();
    work_.left_.rightCols(rest) =
        (sigma_ * ha) * (work_.weighted_.rightCols(rest) + sigma_ * j.mass.rightCols(rest));
    AddProduct(work_.left_, work_.right_, x);
    x.col(at_h) +=
        (sigma_ * scheme_.a21) * work_.weighted_.rightCols(rest).lazyProduct(p.y_rate.tail(rest));
  }
  if (!free_) x.topRows<6>().setZero();
  work_.lu_.Solve(&x);
  if (!std::isfinite(x.sum())) return false;  // as soon as one entry is not
  s.rate_by = sigma_ * x;
  s.rate_by.col(at_h) -= inv_h * s.y_rate;
  if (i > 0) {
    s.rate_by -= (sigma_ * ha) * p.rate_by;
    s.rate_by.col(at_h) -= (sigma_ * scheme_.a21) * p.y_rate;
  }
  s.root.setZero();
  if (free_) {
    AddProduct(s.jr, s.rate_by.topRows<6>(), s.root);
    AddProduct(s.jr_rate, x.topRows<6>(), s.root);
  }
  return true;
}

void StepSolver::FinishJacobian(StepJacobian* out) {
  const StepWork::Stage& s = work_.stages_[scheme_.stages - 1];
  const int inputs = model_.input_count();
  const auto split = [&](const auto& from, int row) {
    const auto rows = from.rows();
    out->state.middleRows(row, rows) = from.leftCols(2 * n_);
    out->input.middleRows(row, rows) = from.middleCols(2 * n_, inputs);
    out->step.segment(row, rows) = from.col(2 * n_ + inputs);
  };
  // the root's increment in the body frame of its end
  work_.root_rows_.setZero();
  if (free_) AddProduct(s.jr, s.y_by.topRows<6>(), work_.root_rows_);
  split(work_.root_rows_, 0);
  split(s.y_by.bottomRows(n_ - 6), 6);
  split(s.root, n_);
  split(s.rate_by.bottomRows(n_ - 6), n_ + 6);
  if (!free_) {  // these columns are the support's
    out->support = out->state.middleCols<6>(n_);
    out->support.middleRows<6>(n_).setIdentity();
    out->state.middleCols<6>(n_).setZero();
  }
  if (free_) out->state.topLeftCorner<6, 6>() += Adjoint(model::Inverse(Moved(s)));
  out->state.block(6, 6, n_ - 6, n_ - 6).diagonal().array() += 1.0;  // q = q_0 + y
}

}  // namespace mantle::reduced
