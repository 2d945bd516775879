#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "model/control.h"

/// The grid of a receding horizon, and how few decisions move its tensions.
///
/// Tensions live at the nodes t_0 < ... < t_N and are linear between them, so that what a motor is
/// asked for is continuous and its rate is the slope. Node 0 is what the motor pulls already. The
/// decisions w are changes of the plan at the knots (some of the nodes); between knots the change
/// is linear as well:   u_k = u_k(plan) + sum_j hat_kj w_j,   so the plan itself keeps the grid's
/// full resolution however few the knots are. Where a motor's amplitude is decided, the hats are
/// multiplied by the gait's pulse at the node, 0 to 1 (`shape`).

namespace mantle::controller {

struct Horizon {
  std::vector<double> time_s;  ///< of the nodes from the start; time_s[0] = 0
  std::vector<int> knots;      ///< nodes; the last one is N
  /// Of each node: at most two knots that move it, -1 where none, and their weights.
  struct Hat {
    std::array<int, 2> knot{-1, -1};
    std::array<double, 2> weight{0, 0};
  };
  std::vector<Hat> hats;

  int steps() const { return static_cast<int>(time_s.size()) - 1; }
  double step(int k) const { return time_s[k + 1] - time_s[k]; }
  double length_s() const { return time_s.back(); }
  int knot_count() const { return static_cast<int>(knots.size()); }
};

/// Default knots: eight (or all nodes where there are fewer), denser at the beginning.
Horizon MakeHorizon(const model::ControlGrid& grid);

/// tensions(:, k) += shape(:, k) hat w, for w laid out knot by knot (motors x knots); `shape` is
/// motors x nodes.
void AddChange(const Horizon& horizon, const Eigen::MatrixXd& shape,
               const Eigen::Ref<const Eigen::VectorXd>& w, Eigen::MatrixXd* tensions);

}  // namespace mantle::controller
