#include "controller/condensed.h"

#include <algorithm>

namespace mantle::controller {

Condensed::Condensed(const ReducedModel& model, const Horizon& horizon, StageCost* cost,
                     const ControlOptions& options)
    : model_(model),
      horizon_(horizon),
      cost_(*cost),
      options_(options),
      motors_(model.input_count()),
      columns_(2 * model.velocity_count()),
      far_(*cost, model) {
  const int decisions = horizon.decision_count(), nodes = horizon.steps() + 1;
  hessian_.setZero(decisions, decisions);
  gradient_.setZero(decisions);
  base_gradient_ = low_ = high_ = gradient_;
  residuals_.assign(nodes, VectorX::Zero(cost->rows()));
  weights_.assign(nodes, cost->weights());
  mean_velocity_weights_.assign(nodes, options.cost.mean_velocity);
  jacobians_.assign(nodes, Eigen::MatrixXd::Zero(cost->rows(), columns_));
  positions_.assign(cost->has_mean_velocity() ? nodes : 0, Eigen::MatrixXd::Zero(3, decisions));
  mean_rows_ = positions_;
  weighted_.assign(nodes, Eigen::MatrixXd::Zero(cost->rows(), decisions));
  g_.setZero(columns_, decisions);
  next_ = g_;
  projected_.setZero(cost->rows(), decisions);
  moved_.setZero(columns_);
  moved_next_ = moved_;
  seen_.setZero(cost->rows());
  displaced_.setZero(3, nodes);
  kkt_.setZero(decisions, decisions);
  kkt_rhs_.setZero(decisions, motors_);
  gain_rows_.setZero(kMostGains * motors_, decisions);
  back_.setZero(kMostGains * motors_, columns_);
  back_next_ = back_;
  through_.setZero(kMostGains * motors_, std::max(cost->rows(), 3));
  back_mean_.assign(positions_.size(), Eigen::MatrixXd::Zero(kMostGains * motors_, 3));
  free_.reserve(decisions);
  place_.resize(decisions);
  MakeRows();
  for (int j = 0; j < decisions; ++j) {
    for (int i = j; i < decisions; ++i) {
      hessian_pattern_.row.push_back(i);
      hessian_pattern_.column.push_back(j);
    }
  }
}

double Condensed::StageWeight(int k) const {
  if (k == horizon_.steps()) return 0.5 * horizon_.step(k - 1) + options_.cost.terminal;
  return 0.5 * (horizon_.step(k - 1) + horizon_.step(k));
}

int Condensed::AveragingNode(int k, double* share) const {
  constexpr double kSameTime_s = 1e-9;
  double at = horizon_.time_s[k] - cost_.averaging_s();
  if (at < -kSameTime_s) return -1;
  at = std::max(at, 0.0);
  int node = 0;
  while (horizon_.time_s[node + 1] <= at) ++node;
  *share = (at - horizon_.time_s[node]) / horizon_.step(node);
  return node;
}

void Condensed::AddInputCost(const Trajectory& t, Eigen::MatrixXd* hessian,
                             VectorX* gradient) const {
  const double effort = options_.cost.effort, rate = options_.cost.rate;
  const int steps = horizon_.steps();
  const auto add = [&](int node_a, double by_a, int node_b, double by_b, double weight,
                       double value, int motor) {
    // weight (value + by_a du_a + by_b du_b)^2
    int at[4];
    double by[4];
    int count = 0;
    const auto gather = [&](int node, double factor) {
      if (node <= 0) return;
      const Horizon::Hat& hat = horizon_.hat(node, motor);
      for (int i : {0, 1}) {
        if (hat.decision[i] < 0) continue;
        at[count] = hat.decision[i];
        by[count++] = factor * hat.weight[i];
      }
    };
    gather(node_a, by_a);
    gather(node_b, by_b);
    for (int i = 0; i < count; ++i) {
      (*gradient)(at[i]) += 2 * weight * by[i] * value;
      for (int j = 0; j < count; ++j) (*hessian)(at[i], at[j]) += 2 * weight * by[i] * by[j];
    }
  };
  for (int k = 1; k <= steps; ++k) {
    const double h = horizon_.step(k - 1);
    const double weight = effort * (k == steps ? 0.5 * h : 0.5 * (h + horizon_.step(k)));
    for (int i = 0; i < motors_; ++i) {
      const double u = t.tensions(i, k), before = t.tensions(i, k - 1);
      if (effort > 0) add(k, 1.0, 0, 0.0, weight, u, i);
      if (rate > 0) add(k, 1.0 / h, k - 1, -1.0 / h, rate * h, (u - before) / h, i);
    }
  }
}

void Condensed::Prepare(const Trajectory& t, const PositionHistory& history, double levenberg) {
  const int steps = horizon_.steps();
  hessian_.setZero();
  base_gradient_.setZero();
  g_.setZero();
  next_.setZero();  // columns not yet active change places with those of g_
  trajectory_ = &t;
  for (int k = 0; k < steps; ++k) {
    const int active = horizon_.Active(k + 1);
    const reduced::StepJacobian& j = t.jacobians[k];
    next_.leftCols(active).noalias() = j.state * g_.leftCols(active);
    for (const int node : {k, k + 1}) {
      for (int m = 0; m < motors_; ++m) {
        const Horizon::Hat& hat = horizon_.hat(node, m);
        for (int i : {0, 1}) {
          if (hat.decision[i] >= 0) {
            next_.col(hat.decision[i]) += (0.5 * hat.weight[i]) * j.input.col(m);
          }
        }
      }
    }
    std::swap(g_, next_);
    cost_.Evaluate(t.states[k + 1], &residuals_[k + 1], &jacobians_[k + 1]);
    far_.Weigh(residuals_[k + 1], &weights_[k + 1]);
    const double weight = 2 * StageWeight(k + 1);
    auto s = projected_.leftCols(active);
    s.noalias() = jacobians_[k + 1] * g_.leftCols(active);
    auto ds = weighted_[k + 1].leftCols(active);
    ds.noalias() = (weight * weights_[k + 1]).asDiagonal() * s;
    hessian_.topLeftCorner(active, active).triangularView<Eigen::Lower>() += ds.transpose() * s;
    base_gradient_.head(active).noalias() += ds.transpose() * residuals_[k + 1];
    if (!positions_.empty()) {
      positions_[k + 1].setZero();
      positions_[k + 1].leftCols(active).noalias() =
          t.states[k + 1].root.rotation.toRotationMatrix() * g_.middleRows<3>(3).leftCols(active);
    }
  }
  if (cost_.has_mean_velocity()) AddMeanVelocity(t, history);
  hessian_.triangularView<Eigen::StrictlyUpper>() = hessian_.transpose();
  AddInputCost(t, &hessian_, &base_gradient_);
  double length_s = 0;
  for (const Horizon::Decision& d : horizon_.decisions) length_s += d.length_s;
  curvature_ = hessian_.trace() / (2 * length_s);
  for (int j = 0; j < variables(); ++j) {
    hessian_(j, j) += 2 * levenberg * curvature_ * horizon_.decisions[j].length_s;
  }
  BoundRows(t);
  gradient_ = base_gradient_;
}

void Condensed::AddMeanVelocity(const Trajectory& t, const PositionHistory& history) {
  const double period = cost_.averaging_s();
  for (int k = 1; k <= horizon_.steps(); ++k) {
    double share = 0;
    const int node = AveragingNode(k, &share);
    const double time = t.states[k].time_s;
    Vector3 before;
    Eigen::MatrixXd& s = mean_rows_[k];
    s = positions_[k] / period;
    if (node < 0) {
      before = history.At(time - period);
    } else {
      before =
          (1 - share) * t.states[node].root.position + share * t.states[node + 1].root.position;
      s -= ((1 - share) * positions_[node] + share * positions_[node + 1]) / period;
    }
    const Vector3 residual =
        (t.states[k].root.position - before) / period - cost_.reference().At(time).velocity;
    mean_velocity_weights_[k] =
        options_.cost.mean_velocity * far_.MeanVelocityFactor(residual.squaredNorm());
    const double weight = 2 * StageWeight(k) * mean_velocity_weights_[k];
    hessian_.triangularView<Eigen::Lower>() += weight * s.transpose() * s;
    base_gradient_.noalias() += weight * s.transpose() * residual;
    s *= weight;
  }
}

void Condensed::SetInitialDeviation(const Eigen::Ref<const VectorX>& deviation) {
  const Trajectory& t = *trajectory_;
  gradient_ = base_gradient_;
  moved_ = deviation;
  if (!positions_.empty())
    displaced_.col(0) = t.states[0].root.rotation * Vector3(moved_.segment<3>(3));
  for (int k = 1; k <= horizon_.steps(); ++k) {
    moved_next_.noalias() = t.jacobians[k - 1].state * moved_;
    std::swap(moved_, moved_next_);
    seen_.noalias() = jacobians_[k] * moved_;
    gradient_.noalias() += weighted_[k].transpose() * seen_;
    if (positions_.empty()) continue;
    displaced_.col(k) = t.states[k].root.rotation * Vector3(moved_.segment<3>(3));
    double share = 0;
    const int node = AveragingNode(k, &share);
    Vector3 mean = displaced_.col(k);
    if (node >= 0) mean -= (1 - share) * displaced_.col(node) + share * displaced_.col(node + 1);
    gradient_.noalias() += mean_rows_[k].transpose() * (mean / cost_.averaging_s());
  }
}

double Condensed::Cost(const Trajectory& t, const PositionHistory& history) {
  double cost = 0;
  VectorX& residual = residuals_[0];
  for (int k = 1; k <= horizon_.steps(); ++k) {
    cost_.Evaluate(t.states[k], &residual, nullptr);
    cost += StageWeight(k) * far_.Value(residual);
    const double h = horizon_.step(k - 1);
    const double share = k == horizon_.steps() ? 0.5 * h : 0.5 * (h + horizon_.step(k));
    cost += share * options_.cost.effort * t.tensions.col(k).squaredNorm();
    cost += options_.cost.rate / h * (t.tensions.col(k) - t.tensions.col(k - 1)).squaredNorm();
    if (!cost_.has_mean_velocity()) continue;
    const double time = t.states[k].time_s, period = cost_.averaging_s();
    double by = 0;
    const int node = AveragingNode(k, &by);
    const Vector3 before = node < 0 ? history.At(time - period)
                                    : Vector3((1 - by) * t.states[node].root.position +
                                              by * t.states[node + 1].root.position);
    const double square =
        ((t.states[k].root.position - before) / period - cost_.reference().At(time).velocity)
            .squaredNorm();
    cost += StageWeight(k) * options_.cost.mean_velocity * far_.MeanVelocity(square);
  }
  return cost;
}

}  // namespace mantle::controller
