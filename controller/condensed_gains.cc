#include <Eigen/Cholesky>
#include <algorithm>

#include "controller/condensed.h"

namespace mantle::controller {
namespace {

/// Weight of an active constraint over the Hessian's largest entry.
constexpr double kPenalty = 1e7;

}  // namespace

// Exact multipliers are zero off the active set; those of an interior point, z s = mu, are told
// apart by the larger of z / H and s.
bool Condensed::GainRows(const Eigen::Ref<const VectorX>& w, const SolveResult& solution, int k) {
  auto rows = gain_rows_.middleRows(k * motors_, motors_);
  rows.setZero();
  free_.clear();  // what is decided at node k + 1 or later
  for (int j = 0; j < variables(); ++j) {
    place_[j] = horizon_.decisions[j].at > k ? static_cast<int>(free_.size()) : -1;
    if (place_[j] >= 0) free_.push_back(j);
  }
  const int size = static_cast<int>(free_.size());
  Eigen::Ref<Eigen::MatrixXd> h = kkt_.topLeftCorner(size, size);
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < size; ++i) h(i, j) = hessian_(free_[i], free_[j]);
  }
  const double penalty = kPenalty * h.diagonal().maxCoeff();
  for (int i = 0; i < size; ++i) {
    const int at = free_[i];
    const double give = 1 / hessian_(at, at);
    if (Holds(solution.z_low(at), give, w(at) - low_(at)) ||
        Holds(solution.z_high(at), give, high_(at) - w(at))) {
      h(i, i) += penalty;
    }
  }
  for (std::size_t r = 0; r < used_.size(); ++r) {
    const Row& row = rows_[used_[r]];
    const double value = row.Value(w), multiplier = solution.lambda(static_cast<Eigen::Index>(r));
    double give = 0;
    for (int i = 0; i < row.count; ++i) {
      give += row.by[i] * row.by[i] / hessian_(row.at[i], row.at[i]);
    }
    if (!Holds(-multiplier, give, value - row.low) && !Holds(multiplier, give, row.high - value)) {
      continue;
    }
    for (int i = 0; i < row.count; ++i) {
      for (int j = 0; j < row.count; ++j) {
        const int a = place_[row.at[i]], b = place_[row.at[j]];
        if (a >= 0 && b >= 0) h(a, b) += penalty * row.by[i] * row.by[j];
      }
    }
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(h);
  if (factor.info() != Eigen::Success) return false;
  auto rhs = kkt_rhs_.topRows(size);
  rhs.setZero();
  for (int m = 0; m < motors_; ++m) {
    const Horizon::Hat& hat = horizon_.hat(k + 1, m);
    for (int i : {0, 1}) {
      if (hat.decision[i] >= 0 && place_[hat.decision[i]] >= 0) {
        rhs(place_[hat.decision[i]], m) += hat.weight[i];
      }
    }
  }
  factor.matrixL().solveInPlace(rhs);
  factor.matrixU().solveInPlace(rhs);
  for (int i = 0; i < size; ++i) rows.col(free_[i]) = rhs.row(i).transpose();
  return true;
}

void Condensed::AddMeanGain(int i, Eigen::Index rows) {
  if (i > 0) {
    auto through = through_.topLeftCorner(rows, 3);
    through.noalias() = gain_rows_.topRows(rows) * mean_rows_[i].transpose();
    through /= cost_.averaging_s();
    back_mean_[i].topRows(rows) += through;
    double share = 0;
    const int node = AveragingNode(i, &share);
    if (node >= 0) {
      back_mean_[node].topRows(rows) -= (1 - share) * through;
      back_mean_[node + 1].topRows(rows) -= share * through;
    }
  }
  back_.topRows(rows).middleCols<3>(3).noalias() +=
      back_mean_[i].topRows(rows) * trajectory_->states[i].root.rotation.toRotationMatrix();
}

void Condensed::Gains(const Eigen::Ref<const VectorX>& w, const SolveResult& solution, int count,
                      std::vector<Eigen::MatrixXd>* gains) {
  count = std::min({count, kMostGains, horizon_.steps()});
  gains->resize(count);
  for (int k = 0; k < count; ++k) {
    if (!GainRows(w, solution, k)) gain_rows_.middleRows(k * motors_, motors_).setZero();
  }
  const Trajectory& t = *trajectory_;
  const Eigen::Index all = count * motors_;
  auto p = gain_rows_.topRows(all);
  auto back = back_.topRows(all), next = back_next_.topRows(all);
  back.setZero();
  for (Eigen::MatrixXd& mean : back_mean_) mean.setZero();
  for (int i = horizon_.steps(); i >= 0; --i) {
    if (i > 0) {
      const int active = horizon_.Active(i);
      auto through = through_.topLeftCorner(all, weighted_[i].rows());
      through.noalias() = p.leftCols(active) * weighted_[i].leftCols(active).transpose();
      back.noalias() += through * jacobians_[i];
    }
    if (!positions_.empty()) AddMeanGain(i, all);
    if (i < count) (*gains)[i] = -back.middleRows(i * motors_, motors_);
    if (i == 0) break;
    next.noalias() = back * t.jacobians[i - 1].state;
    back = next;
  }
}

}  // namespace mantle::controller
