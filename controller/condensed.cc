#include "controller/condensed.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace mantle::controller {
namespace {

constexpr int kMostGains = 6;
/// A tension this close to its bound [N] stays there when the state changes.
constexpr double kActive_n = 2e-4;
/// Weight of an active constraint over the Hessian's largest entry.
constexpr double kPenalty = 1e7;
/// What a row left out of the program may be broken by [N].
constexpr double kSlack_n = 0.01;

}  // namespace

Condensed::Condensed(const ReducedModel& model, const Horizon& horizon, StageCost* cost,
                     const model::ControlOptions& options)
    : model_(model),
      horizon_(horizon),
      cost_(*cost),
      options_(options),
      motors_(model.input_count()),
      columns_(2 * model.velocity_count()) {
  const int decisions = horizon.decision_count(), nodes = horizon.steps() + 1;
  hessian_.setZero(decisions, decisions);
  sensitivity_.setZero(decisions, columns_);
  gradient_.setZero(decisions);
  base_gradient_ = low_ = high_ = gradient_;
  residuals_.assign(nodes, VectorX::Zero(cost->rows()));
  jacobians_.assign(nodes, Eigen::MatrixXd::Zero(cost->rows(), columns_));
  projected_.assign(nodes, Eigen::MatrixXd::Zero(cost->rows(), decisions));
  positions_.assign(cost->has_mean_velocity() ? nodes : 0, Eigen::MatrixXd::Zero(3, decisions));
  adjoint_.assign(nodes, Eigen::MatrixXd::Zero(decisions, columns_));
  tail_.assign(kMostGains, Eigen::MatrixXd::Zero(decisions, columns_));
  g_.setZero(columns_, decisions);
  next_ = g_;
  weighted_.setZero(std::max(cost->rows(), 3), decisions);
  moved_.setZero(decisions, columns_);
  kkt_.setZero(decisions, decisions);
  kkt_rhs_.setZero(decisions, columns_);
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

void Condensed::Row::Add(int decision, double factor) {
  at[count] = decision;
  by[count++] = factor;
}

void Condensed::AddNode(int k, int motor, double factor, Row* row) const {
  const Horizon::Hat& hat = horizon_.hat(k, motor);
  for (int i : {0, 1}) {
    if (hat.decision[i] >= 0) row->Add(hat.decision[i], factor * hat.weight[i]);
  }
}

// Nodes between knots, then the slope towards every knot. The bounds at knots are those of w.
void Condensed::MakeRows() {
  for (int k = 1; k <= horizon_.steps(); ++k) {
    for (int i = 0; i < motors_; ++i) {
      if (horizon_.decides(k, i)) continue;
      rows_.emplace_back();
      AddNode(k, i, 1.0, &rows_.back());
    }
  }
  for (int j = 0; j < horizon_.decision_count(); ++j) {
    rows_.emplace_back();
    rows_.back().Add(j, 1.0);
    if (horizon_.decisions[j].before >= 0) rows_.back().Add(horizon_.decisions[j].before, -1.0);
  }
  used_.reserve(rows_.size());
  jacobian_pattern_.row.reserve(2 * rows_.size());
  jacobian_pattern_.column.reserve(2 * rows_.size());
}

void Condensed::ChooseRows() {
  used_.clear();
  jacobian_pattern_.row.clear();
  jacobian_pattern_.column.clear();
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    double least = 0, most = 0;
    for (int i = 0; i < row.count; ++i) {
      const double a = row.by[i] * low_(row.at[i]), b = row.by[i] * high_(row.at[i]);
      least += std::min(a, b);
      most += std::max(a, b);
    }
    if (least > row.low - kSlack_n && most < row.high + kSlack_n) continue;
    for (int i = 0; i < row.count; ++i) {
      jacobian_pattern_.row.push_back(static_cast<int>(used_.size()));
      jacobian_pattern_.column.push_back(row.at[i]);
    }
    used_.push_back(static_cast<int>(r));
  }
}

void Condensed::BoundRows(const Trajectory& t) {
  auto row = rows_.begin();
  for (int k = 1; k <= horizon_.steps(); ++k) {
    for (int i = 0; i < motors_; ++i) {
      const model::MotorLimits& limits = options_.motors[i];
      const double low = std::min(limits.min_tension_n - t.tensions(i, k), 0.0);
      const double high = std::max(limits.max_tension_n - t.tensions(i, k), 0.0);
      if (horizon_.decides(k, i)) {
        low_(horizon_.hat(k, i).decision[1]) = low;
        high_(horizon_.hat(k, i).decision[1]) = high;
      } else {
        row->low = low;
        row->high = high;
        ++row;
      }
    }
  }
  for (const Horizon::Decision& d : horizon_.decisions) {
    const double most = options_.motors[d.motor].max_rate_n_s;
    double low = -kInfinity, high = kInfinity;
    for (int k = d.from; k < d.at; ++k) {
      const double slope =
          (t.tensions(d.motor, k + 1) - t.tensions(d.motor, k)) / horizon_.step(k);
      low = std::max(low, -most - slope);
      high = std::min(high, most - slope);
    }
    const double length = horizon_.time_s[d.at] - horizon_.time_s[d.from];
    row->low = std::min(low * length, 0.0);
    row->high = std::max(high * length, 0.0);
    ++row;
  }
  ChooseRows();
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
  for (Eigen::MatrixXd& y : adjoint_) y.setZero();
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
    const double weight = 2 * StageWeight(k + 1);
    Eigen::MatrixXd& s = projected_[k + 1];
    s.leftCols(active).noalias() = jacobians_[k + 1] * g_.leftCols(active);
    auto ds = weighted_.topRows(s.rows()).leftCols(active);
    ds.noalias() = (weight * cost_.weights()).asDiagonal() * s.leftCols(active);
    hessian_.topLeftCorner(active, active).noalias() += ds.transpose() * s.leftCols(active);
    base_gradient_.head(active).noalias() += ds.transpose() * residuals_[k + 1];
    adjoint_[k + 1].topRows(active).noalias() += ds.transpose() * jacobians_[k + 1];
    if (!positions_.empty()) {
      positions_[k + 1].setZero();
      positions_[k + 1].leftCols(active).noalias() =
          t.states[k + 1].root.rotation.toRotationMatrix() * g_.middleRows<3>(3).leftCols(active);
    }
  }
  if (cost_.has_mean_velocity()) AddMeanVelocity(t, history);
  AddInputCost(t, &hessian_, &base_gradient_);
  for (int j = 0; j < variables(); ++j) {
    hessian_(j, j) += 2 * levenberg * horizon_.decisions[j].length_s;
  }
  BoundRows(t);
  // F_k = M_k + Y_k, M_{k-1} = (M_k + Y_k) A_{k-1}
  sensitivity_.setZero();
  for (int k = steps; k >= 0; --k) {
    moved_ = sensitivity_ + adjoint_[k];
    if (k < kMostGains) tail_[k] = moved_;
    if (k > 0) sensitivity_.noalias() = moved_ * t.jacobians[k - 1].state;
  }
  sensitivity_ = tail_[0];
  gradient_ = base_gradient_;
}

void Condensed::AddMeanVelocity(const Trajectory& t, const PositionHistory& history) {
  const double period = cost_.averaging_s();
  for (int k = 1; k <= horizon_.steps(); ++k) {
    double share = 0;
    const int node = AveragingNode(k, &share);
    const double time = t.states[k].time_s;
    Vector3 before;
    auto s = weighted_.topRows<3>();
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
    const double weight = 2 * StageWeight(k) * options_.cost.mean_velocity;
    hessian_.noalias() += weight * s.transpose() * s;
    base_gradient_.noalias() += weight * s.transpose() * residual;
    const auto add = [&](int at, double by) {
      adjoint_[at].middleCols<3>(3).noalias() +=
          (weight * by / period) * s.transpose() * t.states[at].root.rotation.toRotationMatrix();
    };
    add(k, 1.0);
    if (node >= 0) {
      add(node, -(1 - share));
      add(node + 1, -share);
    }
  }
}

void Condensed::SetInitialDeviation(const Eigen::Ref<const VectorX>& deviation) {
  gradient_.noalias() = sensitivity_ * deviation;
  gradient_ += base_gradient_;
}

double Condensed::Cost(const Trajectory& t, const PositionHistory& history) {
  double cost = 0;
  VectorX& residual = residuals_[0];
  for (int k = 1; k <= horizon_.steps(); ++k) {
    cost_.Evaluate(t.states[k], &residual, nullptr);
    cost += StageWeight(k) * cost_.Value(residual);
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
    cost += StageWeight(k) * options_.cost.mean_velocity *
            ((t.states[k].root.position - before) / period - cost_.reference().At(time).velocity)
                .squaredNorm();
  }
  return cost;
}

double Condensed::Violation(const Eigen::Ref<const VectorX>& w) const {
  double worst = std::max((low_ - w).maxCoeff(), (w - high_).maxCoeff());
  for (const int r : used_) {
    const Row& row = rows_[r];
    const double value = row.Value(w);
    worst = std::max({worst, row.low - value, value - row.high});
  }
  return std::max(worst, 0.0);
}

void Condensed::Gains(const Eigen::Ref<const VectorX>& w, int count,
                      std::vector<Eigen::MatrixXd>* gains) {
  count = std::min({count, kMostGains, horizon_.steps()});
  gains->resize(count);
  for (int k = 0; k < count; ++k) {
    free_.clear();  // what is decided at node k + 1 or later
    for (int j = 0; j < variables(); ++j) {
      place_[j] = horizon_.decisions[j].at > k ? static_cast<int>(free_.size()) : -1;
      if (place_[j] >= 0) free_.push_back(j);
    }
    const int size = static_cast<int>(free_.size());
    Eigen::Ref<Eigen::MatrixXd> h = kkt_.topLeftCorner(size, size);
    auto rhs = kkt_rhs_.topRows(size);
    for (int j = 0; j < size; ++j) {
      for (int i = 0; i < size; ++i) h(i, j) = hessian_(free_[i], free_[j]);
      rhs.row(j) = tail_[k].row(free_[j]);
    }
    const double penalty = kPenalty * h.diagonal().maxCoeff();
    for (int i = 0; i < size; ++i) {
      const int at = free_[i];
      if (w(at) - low_(at) < kActive_n || high_(at) - w(at) < kActive_n) h(i, i) += penalty;
    }
    for (const int r : used_) {
      const Row& row = rows_[r];
      const double value = row.Value(w);
      if (value - row.low > kActive_n && row.high - value > kActive_n) continue;
      for (int i = 0; i < row.count; ++i) {
        for (int j = 0; j < row.count; ++j) {
          const int a = place_[row.at[i]], b = place_[row.at[j]];
          if (a >= 0 && b >= 0) h(a, b) += penalty * row.by[i] * row.by[j];
        }
      }
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(h);
    factor.matrixL().solveInPlace(rhs);
    factor.matrixU().solveInPlace(rhs);
    Eigen::MatrixXd& gain = (*gains)[k];
    gain.setZero(motors_, columns_);
    for (int m = 0; m < motors_; ++m) {
      const Horizon::Hat& hat = horizon_.hat(k + 1, m);
      for (int i : {0, 1}) {
        if (hat.decision[i] >= 0 && place_[hat.decision[i]] >= 0) {
          gain.row(m) -= hat.weight[i] * rhs.row(place_[hat.decision[i]]);
        }
      }
    }
  }
}

void Condensed::Bounds(double* x_low, double* x_high, double* g_low, double* g_high) const {
  std::copy(low_.begin(), low_.end(), x_low);
  std::copy(high_.begin(), high_.end(), x_high);
  for (std::size_t r = 0; r < used_.size(); ++r) {
    g_low[r] = rows_[used_[r]].low;
    g_high[r] = rows_[used_[r]].high;
  }
}

void Condensed::Start(double* x) const { std::fill_n(x, gradient_.size(), 0.0); }

bool Condensed::Objective(const double* x, bool, double* f) {
  *f = Model(Eigen::Map<const VectorX>(x, gradient_.size()));
  return true;
}

bool Condensed::Gradient(const double* x, bool, double* gradient) {
  Eigen::Map<VectorX> out(gradient, gradient_.size());
  out.noalias() = hessian_ * Eigen::Map<const VectorX>(x, gradient_.size());
  out += gradient_;
  return true;
}

bool Condensed::Constraints(const double* x, bool, double* g) {
  const Eigen::Map<const VectorX> w(x, gradient_.size());
  for (std::size_t r = 0; r < used_.size(); ++r) g[r] = rows_[used_[r]].Value(w);
  return true;
}

bool Condensed::Jacobian(const double*, bool, double* values) {
  for (const int r : used_) values = std::copy_n(rows_[r].by.begin(), rows_[r].count, values);
  return true;
}

bool Condensed::Hessian(const double*, bool, double factor, const double*, double* values) {
  for (std::size_t e = 0; e < hessian_pattern_.row.size(); ++e) {
    values[e] = factor * hessian_(hessian_pattern_.row[e], hessian_pattern_.column[e]);
  }
  return true;
}

void PositionHistory::Reset(double t_s, const Vector3& position) {
  entries_.clear();
  entries_.reserve(4096);
  entries_.push_back({t_s, position});
}

void PositionHistory::Add(double t_s, const Vector3& position) {
  if (!entries_.empty() && t_s <= entries_.back().time_s) return;
  entries_.push_back({t_s, position});
  std::size_t old = 0;
  while (old + 1 < entries_.size() && entries_[old + 1].time_s < t_s - length_s_) ++old;
  entries_.erase(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(old));
}

Vector3 PositionHistory::At(double t_s) const {
  if (entries_.empty()) return Vector3::Zero();
  if (t_s <= entries_.front().time_s) return entries_.front().position;
  const auto after =
      std::upper_bound(entries_.begin(), entries_.end(), t_s,
                       [](double t, const Entry& entry) { return t < entry.time_s; });
  if (after == entries_.end()) return entries_.back().position;
  const Entry &a = *(after - 1), &b = *after;
  return a.position + (t_s - a.time_s) / (b.time_s - a.time_s) * (b.position - a.position);
}

}  // namespace mantle::controller
