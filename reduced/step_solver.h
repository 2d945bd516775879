#pragma once

#include "reduced/step.h"

namespace mantle::reduced {

using model::PlantInputs;

/// Stages, diagonal coefficient and the first stage's weight in the second.
struct Scheme {
  int stages;
  double gamma, a21;
};
Scheme SchemeOf(StepScheme scheme);

/// One step in the making: step.h's stages by Newton's method (step.cc), and their derivatives
/// (step_derivatives.cc).
class StepSolver {
 public:
  StepSolver(const ReducedModel& model, const StepSettings& settings, double h,
             const ReducedState& from, const PlantInputs& first, const PlantInputs& last,
             StepWork* work)
      : model_(model),
        settings_(settings),
        scheme_(SchemeOf(settings.scheme)),
        h_(h),
        sigma_(1.0 / (scheme_.gamma * h)),
        from_(from),
        inputs_{&first, &last},
        work_(*work),
        n_(model.velocity_count()),
        free_(model.root_free()) {}

  bool Solve(bool derivatives, const StepStages* guess, StepOutcome* outcome);
  void Remember(StepStages* stages) const;
  void Finish(ReducedState* to) const;
  void FinishJacobian(StepJacobian* out);

 private:
  static Pose Moved(const StepWork::Stage& s) { return model::ExpSE3(s.y.head<6>()); }
  int InputIndex(int i) const { return scheme_.stages == 1 ? 1 : i; }

  bool Fail(StepOutcome* outcome, const char* cause, double value, double bound) const;
  // y -> state, rates, acceleration.
  void Unpack(int i);
  // Jacobians at the last evaluation, and A = K H_g + (D + sigma M) H_v factored. `weighted_` keeps
  // D + sigma M.
  void Factor(int i, bool with_inputs);
  // Newton's method with one matrix and Broyden's updates of its inverse (Kelley, Iterative Methods
  // for Linear and Nonlinear Equations, 1995, ch. 7); the matrix is made anew where that contracts
  // poorly.
  bool SolveStage(int i, bool derivatives, StepOutcome* outcome);
  bool Evaluate(int i, StepOutcome* outcome);
  // One more Newton step, with the matrix of the derivatives, which are taken before it.
  void Correct(int i);
  // d(y, y_rate, v) of stage i by (zeta_0, q_0, v_0, u, h).
  bool Differentiate(int i);

  const ReducedModel& model_;
  const StepSettings& settings_;
  const Scheme scheme_;
  const double h_, sigma_;
  const ReducedState& from_;
  const PlantInputs* inputs_[2];
  StepWork& work_;
  const int n_;
  const bool free_;
  bool have_matrix_{false};
};

}  // namespace mantle::reduced
