#pragma once

#include "controller/options.h"
#include "controller/parting.h"
#include "controller/plan_buffer.h"

namespace mantle::controller {

/// The fast loop on a plan: at a SYNC it commands u(t) + K (x(s) - x_plan(s)), s the time of the
/// estimate, where the two have not parted (parting.h). Before the plan begins it goes to its
/// beginning in a straight line; past its end the gait goes on; where the planner has given up,
/// tensions decay to their lower limits.
class PlanTracker {
 public:
  /// Both must outlive it.
  PlanTracker(const ReducedModel& model, const ControlOptions& options);

  /// Tensions to command at t_s [N, one per motor], not yet limited; `estimate` may be null. The
  /// plan is not empty. No allocation.
  void Command(const IssuedPlan& issued, double t_s, const ReducedState* estimate,
               Eigen::Ref<VectorX> tensions);

 private:
  const ControlOptions& options_;
  Parting parting_;
  ReducedState planned_;
  VectorX feedback_, deviation_;
};

}  // namespace mantle::controller
