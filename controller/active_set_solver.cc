#include "controller/active_set_solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "controller/active_set.h"

namespace mantle::controller {
namespace {

using Eigen::VectorXd;

class ActiveSetSolver : public Solver {
 public:
  ActiveSetSolver(std::unique_ptr<Solver> other, FirstGuess guess)
      : other_(std::move(other)), guess_(guess) {}

  void Solve(Program& program, const SolveOptions& options, SolveResult* result) override {
    const auto begin = std::chrono::steady_clock::now();
    if (!program.quadratic()) {
      Other(program, options, result);
      return;
    }
    held_.clear();
    const bool read = Read(program);
    int before = 0;
    if (read && guess_ == FirstGuess::kOtherSolver && other_ != nullptr) {
      other_->Solve(program, options, result);
      before = result->iterations;
      if (result->status == SolveStatus::kDeadline || before >= options.max_iterations) return;
      Guess(*result);
    }
    SetZero(program, result);
    if (!read) {
      result->status = SolveStatus::kBadNumber;
    } else {
      const ActiveSet::End end =
          method_.Solve(qp_, held_, options.max_iterations - before, options.deadline_ns);
      if (end == ActiveSet::End::kNotConvex) {
        Other(program, options, result);
        return;
      }
      result->iterations = before + method_.points();
      Write(program, end, result);
    }
    result->seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

 private:
  void Other(Program& program, const SolveOptions& options, SolveResult* result) {
    if (other_ != nullptr) {
      other_->Solve(program, options, result);
      return;
    }
    SetZero(program, result);
    result->status = SolveStatus::kFailed;
  }

  static void SetZero(const Program& program, SolveResult* result) {
    result->iterations = 0;
    result->objective = 0;
    result->infeasibility = result->stationarity = result->complementarity = 0;
    result->x.setZero(program.variables());
    result->lambda.setZero(program.constraints());
    result->z_low.setZero(program.variables());
    result->z_high.setZero(program.variables());
  }

  // The quadratic program about x = 0, where its functions are as good as anywhere.
  bool Read(Program& p) {
    const int n = p.variables(), m = p.constraints();
    qp_.hessian.setZero(n, n);
    qp_.gradient.resize(n);
    qp_.low.resize(n + m);
    qp_.high.resize(n + m);
    start_.resize(n);
    offset_.resize(m);
    zero_.setZero(std::max(n, m));
    p.Bounds(qp_.low.data(), qp_.high.data(), qp_.low.data() + n, qp_.high.data() + n);
    p.Start(start_.data());
    const SparsePattern &h = p.HessianPattern(), &j = p.JacobianPattern();
    values_.resize(static_cast<Eigen::Index>(std::max(h.row.size(), j.row.size())));
    if (!p.Gradient(zero_.data(), true, qp_.gradient.data())) return false;
    if (!p.Hessian(zero_.data(), false, 1.0, zero_.data(), values_.data())) return false;
    for (std::size_t e = 0; e < h.row.size(); ++e) {
      qp_.hessian(std::max(h.row[e], h.column[e]), std::min(h.row[e], h.column[e])) +=
          values_(static_cast<Eigen::Index>(e));
    }
    if (!p.Constraints(zero_.data(), false, offset_.data())) return false;
    qp_.low.tail(m) -= offset_;
    qp_.high.tail(m) -= offset_;
    if (!p.Jacobian(zero_.data(), false, values_.data())) return false;
    qp_.first.assign(m + 1, 0);
    for (const int row : j.row) ++qp_.first[row + 1];
    for (int r = 0; r < m; ++r) qp_.first[r + 1] += qp_.first[r];
    next_.assign(qp_.first.begin(), qp_.first.end());
    qp_.column.resize(j.row.size());
    qp_.by.resize(j.row.size());
    bool finite = qp_.hessian.allFinite() && qp_.gradient.allFinite() && offset_.allFinite();
    for (std::size_t e = 0; e < j.row.size(); ++e) {
      const double by = values_(static_cast<Eigen::Index>(e));
      const int at = next_[j.row[e]]++;
      qp_.column[at] = j.column[e];
      qp_.by[at] = by;
      finite = finite && std::isfinite(by);
    }
    return finite;
  }

  // A constraint is taken for active where its multiplier moves the variables by more than its
  // distance: what an interior point has in equal shares, z s = mu, decides by the larger.
  void Guess(const SolveResult& r) {
    const int n = qp_.variables();
    if (!r.x.allFinite()) return;
    for (int c = 0; c < qp_.constraints(); ++c) {
      const double value = qp_.Value(c, r.x);
      double give = 0;  // distance per multiplier
      if (c < n) {
        give = 1 / qp_.hessian(c, c);
      } else {
        for (int e = qp_.first[c - n]; e < qp_.first[c - n + 1]; ++e) {
          give += qp_.by[e] * qp_.by[e] / qp_.hessian(qp_.column[e], qp_.column[e]);
        }
      }
      const double low = c < n ? r.z_low(c) : std::max(-r.lambda(c - n), 0.0);
      const double high = c < n ? r.z_high(c) : std::max(r.lambda(c - n), 0.0);
      if (low * give > std::abs(value - qp_.low(c))) held_.push_back({c, false});
      if (high * give > std::abs(qp_.high(c) - value)) held_.push_back({c, true});
    }
  }

  void Write(Program& p, ActiveSet::End end, SolveResult* result) {
    using End = ActiveSet::End;
    const int n = qp_.variables(), m = qp_.constraints() - n;
    result->status = end == End::kSolved     ? SolveStatus::kSolved
                     : end == End::kBudget   ? SolveStatus::kIterationBudget
                     : end == End::kDeadline ? SolveStatus::kDeadline
                                             : SolveStatus::kInfeasible;
    result->x = method_.x();
    if (end != End::kSolved) Stopped(&result->x);
    for (std::size_t i = 0; i < method_.held().size(); ++i) {
      const ActiveSet::Held& h = method_.held()[i];
      const double u = method_.multiplier(static_cast<int>(i));
      if (h.constraint >= n) {
        result->lambda(h.constraint - n) += h.at_high ? u : -u;
      } else {
        (h.at_high ? result->z_high : result->z_low)(h.constraint) += u;
      }
    }
    if (!result->x.allFinite()) {
      result->x.setZero();
      result->status = SolveStatus::kBadNumber;
    }
    if (!p.Objective(result->x.data(), true, &result->objective) ||
        !std::isfinite(result->objective)) {
      result->status = SolveStatus::kBadNumber;
    }
    Residuals(n, m, result);
  }

  // The better of two feasible points: from the start as far as constraints allow towards the
  // method's point, and towards that point clipped to the bounds of the variables.
  void Stopped(VectorXd* x) {
    const int n = qp_.variables();
    VectorXd clipped = x->cwiseMax(qp_.low.head(n)).cwiseMin(qp_.high.head(n));
    *x = start_ + Share(*x) * (*x - start_);
    clipped = start_ + Share(clipped) * (clipped - start_);
    if (Value(clipped) < Value(*x)) *x = clipped;
  }
  double Value(const VectorXd& x) {
    slope_.noalias() = qp_.hessian.selfadjointView<Eigen::Lower>() * x;
    return 0.5 * x.dot(slope_) + qp_.gradient.dot(x);
  }

  // The largest share of the way from the start to x that no constraint ends.
  double Share(const VectorXd& x) const {
    double share = 1;
    for (int c = 0; c < qp_.constraints(); ++c) {
      const double a = qp_.Value(c, start_), b = qp_.Value(c, x);
      if (b > qp_.high(c))
        share = std::min(share, a < qp_.high(c) ? (qp_.high(c) - a) / (b - a) : 0);
      if (b < qp_.low(c)) share = std::min(share, a > qp_.low(c) ? (qp_.low(c) - a) / (b - a) : 0);
    }
    return share;
  }

  void Residuals(int n, int m, SolveResult* r) {
    slope_.noalias() = qp_.hessian.selfadjointView<Eigen::Lower>() * r->x;
    slope_ += qp_.gradient - r->z_low + r->z_high;
    for (int row = 0; row < m; ++row) {
      for (int e = qp_.first[row]; e < qp_.first[row + 1]; ++e) {
        slope_(qp_.column[e]) += qp_.by[e] * r->lambda(row);
      }
    }
    r->stationarity = slope_.size() > 0 ? slope_.cwiseAbs().maxCoeff() : 0.0;
    for (int c = 0; c < n + m; ++c) {
      const double value = qp_.Value(c, r->x);
      r->infeasibility = std::max({r->infeasibility, qp_.low(c) - value, value - qp_.high(c)});
      const double low = c < n ? r->z_low(c) : std::max(-r->lambda(c - n), 0.0);
      const double high = c < n ? r->z_high(c) : std::max(r->lambda(c - n), 0.0);
      if (low > 0) {
        r->complementarity = std::max(r->complementarity, low * std::abs(value - qp_.low(c)));
      }
      if (high > 0) {
        r->complementarity = std::max(r->complementarity, high * std::abs(qp_.high(c) - value));
      }
    }
  }

  std::unique_ptr<Solver> other_;
  FirstGuess guess_;
  QuadraticProgram qp_;
  ActiveSet method_;
  std::vector<ActiveSet::Held> held_;
  std::vector<int> next_;
  VectorXd values_, zero_, start_, offset_, slope_;
};

}  // namespace

std::unique_ptr<Solver> MakeActiveSetSolver(std::unique_ptr<Solver> other, FirstGuess guess) {
  return std::make_unique<ActiveSetSolver>(std::move(other), guess);
}

}  // namespace mantle::controller
