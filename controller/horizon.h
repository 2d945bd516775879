#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "controller/options.h"

namespace mantle::controller {

/// The grid of a receding horizon, and how few decisions move its tensions.
///
/// Tensions live at the nodes t_0 < ... < t_N and are linear between them, so that a
/// motor's command is continuous and its rate is the slope. Node 0 is what the motor pulls already.
/// The decisions w are changes of the plan of one motor at one of its knots (some of the nodes);
/// between knots the change is linear as well:
///
///   u_k,i = u_k,i(plan) + sum_j hat_kj w_j   over the decisions j of motor i,
///
/// so the plan itself keeps the grid's full resolution however few the knots are. A motor whose
/// pulses are to be formed decides at every node, the others at the grid's knots.
struct Horizon {
  std::vector<double> time_s;  ///< of the nodes from the start; time_s[0] = 0
  std::vector<int> knots;      ///< of the grid: nodes; the last one is N
  int motors{0};

  /// w_j moves `motor` from node `from` (the knot before it, or 0) on, most at node `at`.
  struct Decision {
    int motor, from, at;
    int before;       ///< the motor's decision at `from`; -1 where that is node 0
    double length_s;  ///< integral of its hat over the horizon
  };
  std::vector<Decision> decisions;  ///< `from` ascends: what moves nodes up to k is a head
  /// Of a motor at a node: at most two decisions that move it, -1 where none, and their weights.
  /// The second one is the next knot, with weight 1 on it.
  struct Hat {
    std::array<int, 2> decision{-1, -1};
    std::array<double, 2> weight{0, 0};
  };
  std::vector<Hat> hats;  ///< node by node

  int steps() const { return static_cast<int>(time_s.size()) - 1; }
  double step(int k) const { return time_s[k + 1] - time_s[k]; }
  double length_s() const { return time_s.back(); }
  int knot_count() const { return static_cast<int>(knots.size()); }
  int decision_count() const { return static_cast<int>(decisions.size()); }
  const Hat& hat(int node, int motor) const { return hats[node * motors + motor]; }
  /// Whether the motor decides at that node.
  bool decides(int node, int motor) const { return hat(node, motor).weight[1] == 1.0; }
  /// How many decisions move tensions at nodes 0..k: they are the first ones.
  int Active(int k) const;
};

/// Default knots: eight (or all nodes where there are fewer), denser at the beginning.
Horizon MakeHorizon(const ControlGrid& grid, const std::vector<MotorLimits>& motors);

/// tensions(i, k) += sum_j hat_kj w_j; `tensions` is motors x nodes.
void AddChange(const Horizon& horizon, const Eigen::Ref<const Eigen::VectorXd>& w,
               Eigen::MatrixXd* tensions);

}  // namespace mantle::controller
