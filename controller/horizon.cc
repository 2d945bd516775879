#include "controller/horizon.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace mantle::controller {
namespace {

constexpr int kDefaultKnots = 8;
constexpr double kDensity = 1.5;  // knot j of n at about N (j/n)^kDensity

void AddDecisions(const std::vector<MotorLimits>& motors, Horizon* h) {
  h->motors = static_cast<int>(motors.size());
  for (int m = 0; m < h->motors; ++m) {
    std::vector<int> at = h->knots;
    if (motors[m].decides_every_node) {
      at.resize(h->steps());
      std::iota(at.begin(), at.end(), 1);
    }
    for (std::size_t j = 0; j < at.size(); ++j) {
      const int from = j == 0 ? 0 : at[j - 1], to = j + 1 < at.size() ? at[j + 1] : at[j];
      h->decisions.push_back({m, from, at[j], -1, 0.5 * (h->time_s[to] - h->time_s[from])});
    }
  }
  std::sort(h->decisions.begin(), h->decisions.end(), [](const auto& a, const auto& b) {
    return std::tie(a.from, a.motor) < std::tie(b.from, b.motor);
  });
  h->hats.resize(h->time_s.size() * motors.size());
  std::vector<int> last(motors.size(), -1);
  for (int j = 0; j < h->decision_count(); ++j) {
    Horizon::Decision& d = h->decisions[j];
    d.before = last[d.motor];
    last[d.motor] = j;
    for (int k = d.from + 1; k <= d.at; ++k) {
      const double share =
          (h->time_s[k] - h->time_s[d.from]) / (h->time_s[d.at] - h->time_s[d.from]);
      Horizon::Hat& hat = h->hats[k * h->motors + d.motor];
      hat.decision[1] = j;
      hat.weight[1] = k == d.at ? 1.0 : share;
      if (d.before >= 0 && k < d.at) {
        hat.decision[0] = d.before;
        hat.weight[0] = 1.0 - share;
      }
    }
  }
}

}  // namespace

Horizon MakeHorizon(const ControlGrid& grid, const std::vector<MotorLimits>& motors) {
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
  AddDecisions(motors, &h);
  return h;
}

int Horizon::Active(int k) const {
  const auto end = std::partition_point(decisions.begin(), decisions.end(),
                                        [k](const Decision& d) { return d.from < k; });
  return static_cast<int>(end - decisions.begin());
}

void AddChange(const Horizon& horizon, const Eigen::Ref<const Eigen::VectorXd>& w,
               Eigen::MatrixXd* tensions) {
  for (int k = 1; k <= horizon.steps(); ++k) {
    for (int m = 0; m < horizon.motors; ++m) {
      const Horizon::Hat& hat = horizon.hat(k, m);
      for (int i : {0, 1}) {
        if (hat.decision[i] >= 0) (*tensions)(m, k) += hat.weight[i] * w(hat.decision[i]);
      }
    }
  }
}

}  // namespace mantle::controller
