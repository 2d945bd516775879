#include "controller/multiple_shooting.h"

#include <algorithm>
#include <stdexcept>

namespace mantle::controller {
namespace {

using model::Matrix6;
using model::Vector6;

}  // namespace

MultipleShooting::MultipleShooting(const Horizon& horizon, const Trajectory& base,
                                   Condensed* condensed, StageCost* cost, Propagator* propagator)
    : horizon_(horizon),
      base_(base),
      condensed_(*condensed),
      cost_(*cost),
      propagator_(*propagator),
      decisions_(condensed->variables()),
      size_(static_cast<int>(2 * base.states[0].v.size())),
      motors_(static_cast<int>(base.tensions.rows())),
      now_(base),
      stepped_(base.states) {
  if (cost->has_mean_velocity()) {
    throw std::invalid_argument(
        "multiple shooting: control.cost.mean_velocity is not 0: it couples distant nodes; use the "
        "condensed form");
  }
  input_hessian_.setZero(decisions_, decisions_);
  input_gradient_.setZero(decisions_);
  condensed->AddInputCost(base, &input_hessian_, &input_gradient_);
  residuals_.assign(horizon.steps() + 1, VectorX::Zero(cost->rows()));
  rows_.assign(horizon.steps() + 1, Eigen::MatrixXd::Zero(cost->rows(), size_));
  x_.setZero(variables());
  difference_.setZero(size_);
  mean_.setZero(motors_);
  const auto add = [](SparsePattern* pattern, int row, int column) {
    pattern->row.push_back(row);
    pattern->column.push_back(column);
  };
  for (int k = 0; k < horizon.steps(); ++k) {
    for (int i = 0; i < size_; ++i) {
      const int row = k * size_ + i;
      for (const int at : MovedBy(k)) add(&jacobian_pattern_, row, at);
      for (int j = 0; k > 0 && j < size_; ++j) add(&jacobian_pattern_, row, StateAt(k) + j);
      add(&jacobian_pattern_, row, StateAt(k + 1) + i);
    }
  }
  const SparsePattern& linear = condensed->JacobianPattern();
  for (std::size_t e = 0; e < linear.row.size(); ++e) {
    add(&jacobian_pattern_, horizon.steps() * size_ + linear.row[e], linear.column[e]);
  }
  for (int j = 0; j < decisions_; ++j) {
    for (int i = j; i < decisions_; ++i) add(&hessian_pattern_, i, j);
  }
  for (int k = 1; k <= horizon.steps(); ++k) {
    for (int j = 0; j < size_; ++j) {
      for (int i = j; i < size_; ++i) add(&hessian_pattern_, StateAt(k) + i, StateAt(k) + j);
    }
  }
}

std::vector<int> MultipleShooting::MovedBy(int k) const {
  std::vector<int> decisions;
  for (const int node : {k, k + 1}) {
    for (int m = 0; m < motors_; ++m) {
      for (const int at : horizon_.hat(node, m).decision) {
        if (at >= 0 && std::find(decisions.begin(), decisions.end(), at) == decisions.end()) {
          decisions.push_back(at);
        }
      }
    }
  }
  return decisions;
}

void MultipleShooting::Bounds(double* x_low, double* x_high, double* g_low, double* g_high) const {
  std::fill_n(x_low, variables(), -kInfinity);
  std::fill_n(x_high, variables(), kInfinity);
  const int dynamics = horizon_.steps() * size_;
  std::fill_n(g_low, dynamics, 0.0);
  std::fill_n(g_high, dynamics, 0.0);
  condensed_.Bounds(x_low, x_high, g_low + dynamics, g_high + dynamics);
}

bool MultipleShooting::Move(const double* x, bool fresh) {
  if (!fresh && moved_) return true;
  x_ = Eigen::Map<const VectorX>(x, variables());
  if (!x_.allFinite()) return false;
  now_.tensions = base_.tensions;
  AddChange(horizon_, x_.head(decisions_), &now_.tensions);
  for (int k = 1; k <= horizon_.steps(); ++k) {
    const auto xi = x_.segment(StateAt(k), size_);
    MoveState(base_.states[k], xi, &now_.states[k]);
    cost_.Evaluate(now_.states[k], &residuals_[k], &rows_[k]);
    const Matrix6 chart = model::TangentOperator(xi.head<6>());
    const Eigen::MatrixXd turned = rows_[k].leftCols<6>() * chart;
    rows_[k].leftCols<6>() = turned;
  }
  moved_ = true;
  rolled_ = false;
  return true;
}

bool MultipleShooting::RollNodes() {
  if (rolled_) return true;
  for (int k = 0; k < horizon_.steps(); ++k) {
    mean_ = 0.5 * (now_.tensions.col(k) + now_.tensions.col(k + 1));
    if (!propagator_
             .Step(now_.states[k], horizon_.step(k), mean_, &stepped_[k + 1], &now_.jacobians[k])
             .ok) {
      return false;
    }
  }
  rolled_ = true;
  return true;
}

bool MultipleShooting::Objective(const double* x, bool fresh, double* f) {
  if (!Move(x, fresh)) return false;
  const auto w = x_.head(decisions_);
  *f = 0.5 * w.dot(input_hessian_ * w) + input_gradient_.dot(w);
  for (int k = 1; k <= horizon_.steps(); ++k) {
    *f += condensed_.StageWeight(k) * condensed_.far_error().Value(residuals_[k]);
  }
  return true;
}

bool MultipleShooting::Gradient(const double* x, bool fresh, double* gradient) {
  if (!Move(x, fresh)) return false;
  Eigen::Map<VectorX> g(gradient, variables());
  g.head(decisions_) = input_hessian_ * x_.head(decisions_) + input_gradient_;
  for (int k = 1; k <= horizon_.steps(); ++k) {
    condensed_.far_error().Weigh(residuals_[k], &weights_);
    const VectorX weighted = 2 * condensed_.StageWeight(k) * weights_.cwiseProduct(residuals_[k]);
    g.segment(StateAt(k), size_) = rows_[k].transpose() * weighted;
  }
  return true;
}

bool MultipleShooting::Constraints(const double* x, bool fresh, double* g) {
  if (!Move(x, fresh) || !RollNodes()) return false;
  for (int k = 0; k < horizon_.steps(); ++k) {
    StateDifference(base_.states[k + 1], stepped_[k + 1], difference_);
    Eigen::Map<VectorX>(g + k * size_, size_) = difference_ - x_.segment(StateAt(k + 1), size_);
  }
  return condensed_.Constraints(x, fresh, g + horizon_.steps() * size_);
}

bool MultipleShooting::Jacobian(const double* x, bool fresh, double* values) {
  if (!Move(x, fresh) || !RollNodes()) return false;
  for (int k = 0; k < horizon_.steps(); ++k) {
    const reduced::StepJacobian& j = now_.jacobians[k];
    StateDifference(base_.states[k + 1], stepped_[k + 1], difference_);
    const Matrix6 log = model::TangentOperatorInverse(difference_.head<6>());
    Eigen::MatrixXd by_state = j.state, by_input = j.input;
    by_state.topRows<6>() = log * j.state.topRows<6>();
    by_input.topRows<6>() = log * j.input.topRows<6>();
    if (k > 0) {
      const Matrix6 chart = model::TangentOperator(x_.segment<6>(StateAt(k)));
      const Eigen::MatrixXd turned = by_state.leftCols<6>() * chart;
      by_state.leftCols<6>() = turned;
    }
    const std::vector<int> moved = MovedBy(k);
    for (int i = 0; i < size_; ++i) {
      for (const int at : moved) {
        const int motor = horizon_.decisions[at].motor;
        double share = 0;
        for (const int node : {k, k + 1}) {
          const Horizon::Hat& hat = horizon_.hat(node, motor);
          for (int h : {0, 1}) {
            if (hat.decision[h] == at) share += 0.5 * hat.weight[h];
          }
        }
        *values++ = share * by_input(i, motor);
      }
      for (int c = 0; k > 0 && c < size_; ++c) *values++ = by_state(i, c);
      *values++ = -1.0;
    }
  }
  return condensed_.Jacobian(x, fresh, values);
}

bool MultipleShooting::Hessian(const double* x, bool fresh, double factor, const double*,
                               double* values) {
  if (!Move(x, fresh)) return false;
  for (int j = 0; j < decisions_; ++j) {
    for (int i = j; i < decisions_; ++i) *values++ = factor * input_hessian_(i, j);
  }
  for (int k = 1; k <= horizon_.steps(); ++k) {
    condensed_.far_error().Weigh(residuals_[k], &weights_);
    const Eigen::MatrixXd h =
        rows_[k].transpose() * (2 * condensed_.StageWeight(k) * weights_).asDiagonal() * rows_[k];
    for (int j = 0; j < size_; ++j) {
      for (int i = j; i < size_; ++i) *values++ = factor * h(i, j);
    }
  }
  return true;
}

}  // namespace mantle::controller
