#include "controller/plan_tracker.h"

#include <algorithm>

#include "controller/gait.h"
#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

/// Largest state deviation the gains are trusted with: what they ask for beyond the plan [N].
constexpr double kMostFeedback_n = 0.3;
/// Tensions of a controller that has given up fall to their lower limits within about this time.
constexpr double kDecay_s = 0.5;

}  // namespace

PlanTracker::PlanTracker(const ReducedModel& model, const ControlOptions& options)
    : options_(options),
      parting_(model),
      planned_(InitialState(model)),
      feedback_(VectorX::Zero(model.input_count())),
      deviation_(VectorX::Zero(2 * model.velocity_count())) {}

void PlanTracker::Command(const IssuedPlan& issued, double t_s, const ReducedState* estimate,
                          Eigen::Ref<VectorX> tensions) {
  const Plan& plan = issued.plan;
  if (issued.gives_up) {
    const double share = std::max(0.0, 1.0 - (t_s - issued.issued_s) / kDecay_s);
    for (Eigen::Index i = 0; i < tensions.size(); ++i) {
      const double low = options_.motors[i].min_tension_n;
      tensions(i) = low + share * (issued.tensions_n(i) - low);
    }
    return;
  }
  if (t_s < plan.start_s() && issued.tensions_n.size() > 0) {  // towards the plan's beginning
    const double share = (t_s - issued.issued_s) / (plan.start_s() - issued.issued_s);
    tensions = issued.tensions_n + share * (plan.tensions.col(0) - issued.tensions_n);
    return;
  }
  if (t_s > plan.end_s()) {
    GaitTensions(options_.gait, t_s, tensions);
    return;
  }
  TensionsAt(plan, t_s, tensions);
  // State and plan of one instant, that of the estimate.
  if (estimate == nullptr || plan.gains.empty() || estimate->time_s < plan.start_s()) return;
  const int k = IntervalAt(plan, t_s);
  if (k >= static_cast<int>(plan.gains.size())) return;
  StateAt(plan, estimate->time_s, &planned_);
  if (parting_.Apart(planned_, *estimate)) return;
  StateDifference(planned_, *estimate, deviation_);
  const double share = (t_s - plan.time_s[k]) / (plan.time_s[k + 1] - plan.time_s[k]);
  feedback_.noalias() = share * plan.gains[k] * deviation_;
  if (k > 0) feedback_.noalias() += (1 - share) * plan.gains[k - 1] * deviation_;
  if (!feedback_.allFinite()) return;
  tensions += feedback_.cwiseMax(-kMostFeedback_n).cwiseMin(kMostFeedback_n);
}

}  // namespace mantle::controller
