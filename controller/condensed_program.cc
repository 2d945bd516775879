#include <algorithm>

#include "controller/condensed.h"

// The quadratic program's rows and bounds, and what a solver asks of it.

namespace mantle::controller {
namespace {

/// What a row left out of the program may be broken by [N]: round-off.
constexpr double kSlack_n = 1e-12;

}  // namespace

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
      const MotorLimits& limits = options_.motors[i];
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
      const double slope = (t.tensions(d.motor, k + 1) - t.tensions(d.motor, k)) / horizon_.step(k);
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

double Condensed::Violation(const Eigen::Ref<const VectorX>& w) const {
  double worst = std::max((low_ - w).maxCoeff(), (w - high_).maxCoeff());
  for (const int r : used_) {
    const Row& row = rows_[r];
    const double value = row.Value(w);
    worst = std::max({worst, row.low - value, value - row.high});
  }
  return std::max(worst, 0.0);
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
  const Eigen::Map<const VectorX> w(x, gradient_.size());
  *f = 0;  // Model(w), without a vector for H w
  for (Eigen::Index j = 0; j < w.size(); ++j) {
    *f += w(j) * (0.5 * hessian_.col(j).dot(w) + gradient_(j));
  }
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

}  // namespace mantle::controller
