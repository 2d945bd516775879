#include "controller/horizon.h"

#include <algorithm>
#include <cmath>

namespace mantle::controller {
namespace {

constexpr int kDefaultKnots = 8;
constexpr double kDensity = 1.5;  // knot j of n at about N (j/n)^kDensity

}  // namespace

Horizon MakeHorizon(const model::ControlGrid& grid) {
  Horizon h;
  double t = 0, step = grid.step_s;
  h.time_s.push_back(0);
  for (int k = 0; k < grid.steps; ++k, step *= grid.growth) h.time_s.push_back(t += step);
  h.knots = grid.knots;
  if (h.knots.empty()) {
    const int count = std::min(kDefaultKnots, grid.steps);
    for (int j = 1; j <= count; ++j) {
      const double share = std::pow(static_cast<double>(j) / count, kDensity);
      const int at = static_cast<int>(std::lround(share * grid.steps));
      h.knots.push_back(std::max(at, h.knots.empty() ? 1 : h.knots.back() + 1));
    }
    h.knots.back() = grid.steps;
  }
  h.hats.resize(h.time_s.size());
  int right = 0;
  for (int k = 1; k <= grid.steps; ++k) {
    while (h.knots[right] < k) ++right;
    const double from = right == 0 ? 0.0 : h.time_s[h.knots[right - 1]];
    const double share = (h.time_s[k] - from) / (h.time_s[h.knots[right]] - from);
    Horizon::Hat& hat = h.hats[k];
    hat.knot[1] = right;
    hat.weight[1] = share;
    if (right > 0 && share < 1.0) {
      hat.knot[0] = right - 1;
      hat.weight[0] = 1.0 - share;
    }
  }
  return h;
}

void AddChange(const Horizon& horizon, const Eigen::MatrixXd& shape,
               const Eigen::Ref<const Eigen::VectorXd>& w, Eigen::MatrixXd* tensions) {
  const Eigen::Index motors = tensions->rows();
  for (int k = 1; k <= horizon.steps(); ++k) {
    for (int i : {0, 1}) {
      const int knot = horizon.hats[k].knot[i];
      if (knot < 0) continue;
      tensions->col(k) +=
          horizon.hats[k].weight[i] * shape.col(k).cwiseProduct(w.segment(knot * motors, motors));
    }
  }
}

}  // namespace mantle::controller
