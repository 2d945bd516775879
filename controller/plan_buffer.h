#pragma once

#include <limits>

#include "controller/exchange.h"
#include "controller/plan.h"

namespace mantle::controller {

/// A plan with what the fast loop needs besides it.
struct IssuedPlan {
  Plan plan;
  bool gives_up{false};  ///< the planner has given up: tensions decay to their lower limits
  double issued_s{0};    ///< when it was made, or when the planner gave up
  VectorX tensions_n;    ///< commanded then, one per motor; empty before the first
  /// Time of the newest measurement that the planner has answered, by a plan or by keeping the old.
  double answered_s{-std::numeric_limits<double>::infinity()};
};

/// What a plan that is being made counts on: after the measurement of from_s the motors go in a
/// straight line to these tensions at until_s, where the plan begins.
struct Commitment {
  double from_s{0}, until_s{0};
  VectorX tensions_n;  ///< one per motor; empty before the first
};

/// The way of plans from the planner to the fast loop, by value, so that either may run in a thread
/// of its own: neither waits for the other.
using PlanBuffer = Exchange<IssuedPlan>;

}  // namespace mantle::controller
