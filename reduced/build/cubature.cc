#include "reduced/build/cubature.h"

#include <Eigen/QR>
#include <algorithm>
#include <limits>

namespace mantle::reduced {
namespace {

Eigen::VectorXd SolveOn(const Eigen::MatrixXd& g, const Eigen::VectorXd& b,
                        const std::vector<int>& active) {
  Eigen::MatrixXd a(g.rows(), active.size());
  for (std::size_t i = 0; i < active.size(); ++i) a.col(i) = g.col(active[i]);
  return a.householderQr().solve(b);
}

}  // namespace

Cubature ChooseCubature(const Eigen::MatrixXd& g, double tolerance) {
  const int n = static_cast<int>(g.cols());
  const Eigen::VectorXd b = g.rowwise().sum();
  Eigen::VectorXd w = Eigen::VectorXd::Zero(n);
  std::vector<int> active;
  Cubature out;
  const auto misfit = [&] { return (b - g * w).norm() / b.norm(); };
  while (static_cast<int>(active.size()) < n && misfit() > tolerance) {
    const Eigen::VectorXd gain = g.transpose() * (b - g * w);
    int best = -1;
    for (int i = 0; i < n; ++i) {
      if (w(i) > 0.0) continue;
      if (best < 0 || gain(i) > gain(best)) best = i;
    }
    if (best < 0 || !(gain(best) > 0.0)) break;
    active.push_back(best);
    for (;;) {
      const Eigen::VectorXd x = SolveOn(g, b, active);
      if (x.minCoeff() > 0.0) {
        for (std::size_t i = 0; i < active.size(); ++i) w(active[i]) = x(i);
        break;
      }
      // Step towards x until the first weight vanishes, and drop that one.
      double step = 1.0;
      for (std::size_t i = 0; i < active.size(); ++i) {
        if (x(i) > 0.0) continue;
        const double from = w(active[i]);
        step = std::min(step, from / (from - x(i)));
      }
      for (std::size_t i = 0; i < active.size(); ++i) {
        w(active[i]) += step * (x(i) - w(active[i]));
      }
      std::vector<int> kept;
      for (int i : active) {
        if (w(i) > std::numeric_limits<double>::epsilon()) {
          kept.push_back(i);
        } else {
          w(i) = 0.0;
        }
      }
      active = kept;
      if (active.empty()) break;
    }
    if (active.empty() || w(best) == 0.0) break;  // round-off: the column came back at once
  }
  std::sort(active.begin(), active.end());
  for (int i : active) {
    out.column.push_back(i);
    out.weight.push_back(w(i));
  }
  out.residual = misfit();
  return out;
}

}  // namespace mantle::reduced
