#include "controller/active_set.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace mantle::controller {
namespace {

/// A normal whose part across the held ones is a smaller share of it depends on them.
constexpr double kDependent = 1e-9;
/// What a point may break a constraint by, of the largest bound or coordinate: over round-off times
/// the Hessian's condition.
constexpr double kFeasible = 1e-11;
constexpr int kRefinements = 2;
constexpr double kNever = std::numeric_limits<double>::infinity();

std::int64_t Now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

double QuadraticProgram::Value(int c, const Eigen::VectorXd& x) const {
  const int row = c - variables();
  if (row < 0) return x(c);
  double value = 0;
  for (int e = first[row]; e < first[row + 1]; ++e) value += by[e] * x(column[e]);
  return value;
}

void ActiveSet::Resize(const QuadraticProgram& p) {
  const int n = p.variables();
  program_ = &p;
  if (q_.rows() != n) {
    q_.setZero(n, n);
    r_.setZero(n, n);
    for (Eigen::VectorXd* v : {&x_, &y_, &normal_, &rest_, &along_, &again_, &direction_,
                               &multipliers_, &residual_, &gap_, &change_}) {
      v->setZero(n);
    }
    held_.reserve(n);
  }
  held_.clear();
  is_held_.assign(p.constraints(), 0);
  scale_.resize(p.constraints());
  for (int c = 0; c < n; ++c) scale_(c) = std::sqrt(1 / p.hessian(c, c));
  for (int c = n; c < p.constraints(); ++c) {
    double square = std::numeric_limits<double>::min();
    for (int e = p.first[c - n]; e < p.first[c - n + 1]; ++e) {
      square += p.by[e] * p.by[e] / p.hessian(p.column[e], p.column[e]);
    }
    scale_(c) = std::sqrt(square);
  }
}

double ActiveSet::Bound(const Held& h) const {
  return h.at_high ? -program_->high(h.constraint) : program_->low(h.constraint);
}

void ActiveSet::Normal(const Held& h, Eigen::VectorXd* v) const {
  const double sign = h.at_high ? -1 : 1;
  const int row = h.constraint - program_->variables();
  v->setZero();
  if (row < 0) {
    (*v)(h.constraint) = sign;
  } else {
    for (int e = program_->first[row]; e < program_->first[row + 1]; ++e) {
      (*v)(program_->column[e]) += sign * program_->by[e];
    }
  }
  factor_.matrixL().solveInPlace(*v);
}

double ActiveSet::Split(const Eigen::VectorXd& v) {
  const auto k = static_cast<Eigen::Index>(held_.size());
  const auto q = q_.leftCols(k);
  rest_ = v;
  along_.head(k).noalias() = q.transpose() * v;
  rest_.noalias() -= q * along_.head(k);
  again_.head(k).noalias() = q.transpose() * rest_;  // twice is enough (Kahan)
  rest_.noalias() -= q * again_.head(k);
  along_.head(k) += again_.head(k);
  const double norm = rest_.norm();
  return k < v.size() && norm > kDependent * v.norm() ? norm : 0.0;
}

// `rest_` and `along_` are those of its normal.
void ActiveSet::Hold(const Held& h, double multiplier, double norm) {
  const auto k = static_cast<Eigen::Index>(held_.size());
  q_.col(k) = rest_ / norm;
  r_.col(k).head(k) = along_.head(k);
  r_(k, k) = norm;
  multipliers_(k) = multiplier;
  is_held_[h.constraint] = 1;
  held_.push_back(h);
}

void ActiveSet::Drop(int i) {
  const auto k = static_cast<Eigen::Index>(held_.size()) - 1;
  is_held_[held_[i].constraint] = 0;
  held_.erase(held_.begin() + i);
  for (Eigen::Index c = i; c < k; ++c) {
    multipliers_(c) = multipliers_(c + 1);
    r_.col(c).head(c + 2) = r_.col(c + 1).head(c + 2);
  }
  for (Eigen::Index c = i; c < k; ++c) {  // R becomes triangular again
    const double a = r_(c, c), b = r_(c + 1, c), length = std::hypot(a, b);
    const double cosine = a / length, sine = b / length;
    for (Eigen::Index j = c; j < k; ++j) {
      const double top = r_(c, j), bottom = r_(c + 1, j);
      r_(c, j) = cosine * top + sine * bottom;
      r_(c + 1, j) = cosine * bottom - sine * top;
    }
    again_ = q_.col(c);
    q_.col(c) = cosine * again_ + sine * q_.col(c + 1);
    q_.col(c + 1) = cosine * q_.col(c + 1) - sine * again_;
  }
}

void ActiveSet::Point() {
  x_ = y_;
  factor_.matrixU().solveInPlace(x_);
}

void ActiveSet::BackSubstitute(Eigen::VectorXd* b) const {
  const auto k = static_cast<Eigen::Index>(held_.size());
  auto head = b->head(k);
  r_.topLeftCorner(k, k).triangularView<Eigen::Upper>().solveInPlace(head);
}

void ActiveSet::ForwardSubstitute(Eigen::VectorXd* b) const {
  const auto k = static_cast<Eigen::Index>(held_.size());
  auto head = b->head(k);
  r_.topLeftCorner(k, k).triangularView<Eigen::Upper>().transpose().solveInPlace(head);
}

// The minimum over the guess held as equations: y = y_0 + Q R^-T (b - N^T x_0), multipliers
// R^-1 R^-T (b - N^T x_0); what pulls the wrong way goes, the worst first.
void ActiveSet::Begin(const std::vector<Held>& guess) {
  y_ = -program_->gradient;
  factor_.matrixL().solveInPlace(y_);
  Point();
  for (const Held& h : guess) {
    if (is_held_[h.constraint] || !std::isfinite(Bound(h))) continue;
    Normal(h, &normal_);
    const double norm = Split(normal_);
    if (norm > 0) Hold(h, 0, norm);
  }
  while (!held_.empty()) {
    const auto k = static_cast<Eigen::Index>(held_.size());
    for (Eigen::Index i = 0; i < k; ++i) {
      const double value = program_->Value(held_[i].constraint, x_);
      gap_(i) = Bound(held_[i]) - (held_[i].at_high ? -value : value);
    }
    ForwardSubstitute(&gap_);
    multipliers_.head(k) = gap_.head(k);
    BackSubstitute(&multipliers_);
    Eigen::Index worst = 0;
    if (multipliers_.head(k).minCoeff(&worst) >= 0) {
      y_.noalias() += q_.leftCols(k) * gap_.head(k);
      return;
    }
    Drop(static_cast<int>(worst));
  }
}

// By the ascent of the dual objective that it promises: violation over the normal's length in the
// metric of H, with H's diagonal alone.
bool ActiveSet::MostViolated(Held* most, double* violation) const {
  double worst = 0;
  const auto look = [&](int c, double value) {
    const double below = program_->low(c) - value, above = value - program_->high(c);
    const double by = std::max(below, above);
    if (by <= feasible_ || by <= worst * scale_(c)) return;
    worst = by / scale_(c);
    *most = {c, above > below};
    *violation = by;
  };
  for (int c = 0; c < program_->constraints(); ++c) {
    if (!is_held_[c]) look(c, program_->Value(c, x_));
  }
  return worst > 0;
}

// One Newton step on the conditions H x + g = N u, N^T x = b with residuals from H itself.
void ActiveSet::Refine() {
  const auto k = static_cast<Eigen::Index>(held_.size());
  const int n = program_->variables();
  residual_.noalias() = program_->hessian.selfadjointView<Eigen::Lower>() * x_;
  residual_ += program_->gradient;
  for (Eigen::Index i = 0; i < k; ++i) {
    const Held& h = held_[i];
    const double u = h.at_high ? -multipliers_(i) : multipliers_(i);
    const int row = h.constraint - n;
    if (row < 0) {
      residual_(h.constraint) -= u;
    } else {
      for (int e = program_->first[row]; e < program_->first[row + 1]; ++e) {
        residual_(program_->column[e]) -= u * program_->by[e];
      }
    }
    const double value = program_->Value(h.constraint, x_);
    gap_(i) = Bound(h) - (h.at_high ? -value : value);
  }
  factor_.matrixL().solveInPlace(residual_);
  // dy = V du - L^-1 residual with V^T dy = gap; V = Q R
  along_.head(k).noalias() = q_.leftCols(k).transpose() * residual_;
  ForwardSubstitute(&gap_);
  again_.head(k) = gap_.head(k) + along_.head(k);
  change_.noalias() = q_.leftCols(k) * again_.head(k);
  change_ -= residual_;
  BackSubstitute(&again_);
  multipliers_.head(k) += again_.head(k);
  multipliers_.head(k) = multipliers_.head(k).cwiseMax(0.0);
  factor_.matrixU().solveInPlace(change_);
  x_ += change_;
}

ActiveSet::End ActiveSet::Solve(const QuadraticProgram& program, const std::vector<Held>& guess,
                                int most_points, std::int64_t deadline_ns) {
  points_ = 0;
  Resize(program);
  x_.setZero();
  const auto late = [&] { return deadline_ns != 0 && Now_ns() > deadline_ns; };
  if (late()) return End::kDeadline;
  factor_.compute(program.hessian);
  if (factor_.info() != Eigen::Success) return End::kNotConvex;
  Begin(guess);
  ++points_;
  double size = 0;
  for (int c = 0; c < program.constraints(); ++c) {
    for (const double bound : {program.low(c), program.high(c)}) {
      if (std::isfinite(bound)) size = std::max(size, std::abs(bound));
    }
  }
  for (;;) {
    Point();
    if (!x_.allFinite()) return End::kNotConvex;
    feasible_ = kFeasible * std::max(size, x_.cwiseAbs().maxCoeff());
    Held next;
    double violation = 0;
    if (!MostViolated(&next, &violation)) break;
    Normal(next, &normal_);
    double multiplier = 0;
    for (bool holds = false; !holds;) {
      if (points_ >= most_points) return Point(), End::kBudget;
      if (late()) return Point(), End::kDeadline;
      ++points_;
      const double norm = Split(normal_);
      const auto k = static_cast<Eigen::Index>(held_.size());
      direction_.head(k) = along_.head(k);
      BackSubstitute(&direction_);
      double least = kNever;  // step at which a multiplier vanishes
      int gone = -1;
      for (Eigen::Index i = 0; i < k; ++i) {
        if (direction_(i) <= 0 || multipliers_(i) >= least * direction_(i)) continue;
        least = multipliers_(i) / direction_(i);
        gone = static_cast<int>(i);
      }
      const double full =
          norm > 0 ? std::max(0.0, Bound(next) - normal_.dot(y_)) / (norm * norm) : kNever;
      const double step = std::min(least, full);
      if (step == kNever) return Point(), End::kInfeasible;
      if (norm > 0) y_ += step * rest_;
      multipliers_.head(k) -= step * direction_.head(k);
      multiplier += step;
      holds = full <= least;
      if (holds) {
        Hold(next, multiplier, norm);
      } else {
        multipliers_(gone) = 0;
        Drop(gone);
      }
    }
  }
  for (int i = 0; i < kRefinements; ++i) Refine();
  return End::kSolved;
}

}  // namespace mantle::controller
