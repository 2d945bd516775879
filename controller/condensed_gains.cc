#include <Eigen/Cholesky>
#include <algorithm>

#include "controller/condensed.h"

namespace mantle::controller {
namespace {

/// A tension this close to its bound [N] stays there when the state changes.
constexpr double kActive_n = 2e-4;
/// Weight of an active constraint over the Hessian's largest entry.
constexpr double kPenalty = 1e7;

}  // namespace

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
    Eigen::MatrixXd& gain = (*gains)[k];
    gain.setZero(motors_, columns_);
    if (factor.info() != Eigen::Success) continue;  // a cost that leaves tensions open: no feedback
    factor.matrixL().solveInPlace(rhs);
    factor.matrixU().solveInPlace(rhs);
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

}  // namespace mantle::controller
