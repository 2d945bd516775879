#pragma once

#include <array>
#include <atomic>

#include "controller/plan.h"

namespace mantle::controller {

/// A plan with what the fast loop needs besides it.
struct IssuedPlan {
  Plan plan;
  bool gives_up{false};  ///< the planner has given up: tensions decay to their lower limits
  double issued_s{0};    ///< when it was made, or when the planner gave up
  VectorX tensions_n;    ///< commanded then, one per motor; empty before the first
};

/// The way of plans from the planner to the fast loop, by value, so that either may run in a thread
/// of its own: neither waits for the other.
///
/// Three places: one that the planner writes, one that the fast loop reads, and one between them
/// that either swaps its own for in one atomic exchange. The fast loop so always has the newest
/// plan that was complete, and keeps it while it likes.
class PlanBuffer {
 public:
  /// From the planner's thread: hands the plan over. Allocates only where sizes grow.
  void Publish(const IssuedPlan& plan) {
    places_[static_cast<std::size_t>(writing_)] = plan;
    writing_ = between_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kPlace;
  }
  /// From the fast loop's thread: the newest plan becomes the current one. False where none came
  /// since the last call.
  bool Take() {
    if ((between_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    reading_ = between_.exchange(reading_, std::memory_order_acq_rel) & kPlace;
    return true;
  }
  /// From the fast loop's thread: what was taken last; an empty plan before that.
  const IssuedPlan& current() const { return places_[static_cast<std::size_t>(reading_)]; }

 private:
  static constexpr int kPlace = 3, kFresh = 4;

  std::array<IssuedPlan, 3> places_;
  int writing_{0}, reading_{1};
  std::atomic<int> between_{2};
};

}  // namespace mantle::controller
