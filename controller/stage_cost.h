#pragma once

#include <string_view>
#include <vector>

#include "controller/reference.h"
#include "reduced/outputs.h"

namespace mantle::controller {

using model::VectorX;
using reduced::ReducedModel;
using reduced::ReducedState;

/// The state's part of the stage cost as weighted squares, l = sum_i d_i r_i(x, t)^2, with exact
/// Jacobians of the residuals in (zeta, dq, dv): the Gauss-Newton Hessian 2 C^T D C follows.
/// Model and formula: controller/options.h. Soft bounds are rows max(0, what is outside).
///
/// The mean velocity over a pulse of length T ends at the state: (p(t) - p(t - T)) / T - v_ref. It
/// couples two nodes of a horizon, so its residual is made by the caller from positions.
class StageCost {
 public:
  /// All must outlive it.
  StageCost(const ReducedModel& model, const ControlOptions& options, const Reference& reference);

  int rows() const { return static_cast<int>(weights_.size()); }
  /// d_i [1/s per unit^2].
  const VectorX& weights() const { return weights_; }

  /// At state.time_s. `residual`: rows(); `jacobian`: rows() x 2 velocity_count, or null. No
  /// allocation.
  void Evaluate(const ReducedState& state, VectorX* residual, Eigen::MatrixXd* jacobian);

  /// sum d_i r_i^2 of the last Evaluate's residual.
  double Value(const VectorX& residual) const { return weights_.dot(residual.cwiseAbs2()); }
  /// Rows of one named weight of the scene; soft bounds are one term.
  struct Term {
    std::string_view name;  ///< as in the scene's table control.cost
    int first, count;
  };
  const std::vector<Term>& terms() const { return terms_; }
  /// What a term adds, of the last Evaluate's residual.
  double Value(const VectorX& residual, const Term& term) const {
    return weights_.segment(term.first, term.count)
        .dot(residual.segment(term.first, term.count).cwiseAbs2());
  }
  /// Of tensions u, of their rates, and of both.
  double EffortValue(const Eigen::Ref<const VectorX>& u) const;
  double RateValue(const Eigen::Ref<const VectorX>& rate) const;
  double InputValue(const Eigen::Ref<const VectorX>& u,
                    const Eigen::Ref<const VectorX>& rate) const {
    return EffortValue(u) + RateValue(rate);
  }

  bool has_mean_velocity() const { return options_.cost.mean_velocity > 0; }
  double averaging_s() const { return options_.gait.period_s; }
  const ControlOptions& options() const { return options_; }
  const Reference& reference() const { return reference_; }

 private:
  void EvaluateBounds(const ReducedState& state, int row, VectorX* residual,
                      Eigen::MatrixXd* jacobian);

  const ReducedModel& model_;
  const ControlOptions& options_;
  const Reference& reference_;
  VectorX weights_;
  std::vector<Term> terms_;
  int position_{-1}, heading_{-1}, velocity_{-1}, turn_{-1}, tip_{-1}, volume_{-1}, bounds_{-1};
  std::vector<reduced::VolumeFunction> volume_function_;  ///< none or one
  double reference_volume_m3_{1};
  Eigen::Matrix3Xd tip_jacobian_;
  /// Bending strains in the middle of every group: rows of B, and the arm's first coordinate.
  struct Bend {
    int first;
    Eigen::Matrix2Xd basis;
  };
  std::vector<Bend> bends_;  ///< groups_ for every bound on curvature
  std::size_t groups_{0};
};

}  // namespace mantle::controller
