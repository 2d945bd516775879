#include "loop/control_side/planner.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <vector>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {
namespace {

using controller::Disturbance;
using controller::MotorLimits;
using firmware_sim::MonotonicTime_us;
using firmware_sim::SleepFor;
using model::VectorX;

/// Notes what it is called with; an Update takes as long as it is told.
class Slow final : public controller::Controller {
 public:
  explicit Slow(std::int64_t update_us) : update_us_(update_us) {}
  void Start(const reduced::ReducedState&) override { Note("start"); }
  void Update(double t_s, const reduced::ReducedState*, const Eigen::Ref<const VectorX>&,
              std::int64_t deadline_ns) override {
    Note("update " + std::to_string(std::lround(100 * t_s)));
    deadline = deadline_ns;
    SleepFor(update_us_);
  }
  void Prepare(double t_s, const Eigen::Ref<const VectorX>&) override {
    Note("prepare " + std::to_string(std::lround(100 * t_s)));
  }
  void SetLimits(const std::vector<MotorLimits>& limits) override {
    Note(limits[0].max_tension_n == 0 ? "lost" : "sound");
  }
  void Command(double, const reduced::ReducedState*, Eigen::Ref<VectorX>) override {}
  bool plans_apart() const override { return true; }

  std::vector<std::string> calls() {
    const std::lock_guard guard(mutex_);
    return calls_;
  }
  std::atomic<std::int64_t> deadline{0};

 private:
  void Note(const std::string& call) {
    const std::lock_guard guard(mutex_);
    calls_.push_back(call);
  }
  std::int64_t update_us_;
  std::mutex mutex_;
  std::vector<std::string> calls_;
};

reduced::ReducedState Still() {
  reduced::ReducedState state;
  state.q.setZero(2);
  state.v.setZero(8);
  return state;
}

void Await(const Planner& planner, long cycle) {
  for (int i = 0; i < 5000 && planner.answered() != cycle; ++i) SleepFor(1000);
  EXPECT_EQ(planner.answered(), cycle);
}

TEST(Planner, DoesInItsThreadWhatALoopInOneThreadWouldDo) {
  Slow controller(0);
  Planner planner(controller, 0.008, Still(), std::vector<MotorLimits>(1));
  planner.PostStart(Still());
  planner.PostUpdate(0, 0.0, Still(), VectorX::Zero(1));
  Await(planner, 0);
  planner.PostPrepare(0.05, VectorX::Zero(1), Disturbance(1));
  SleepFor(50'000);
  planner.PostUpdate(5, 0.05, Still(), VectorX::Zero(1));
  Await(planner, 5);
  planner.Stop();
  EXPECT_EQ(controller.calls(),
            (std::vector<std::string>{"start", "update 0", "prepare 5", "update 5"}));
  EXPECT_GT(controller.deadline, 0);
  EXPECT_EQ(planner.counters().jobs, 2);
  EXPECT_EQ(planner.counters().overtaken, 0);
}

TEST(Planner, PlansForTheNewestMeasurementAndPassesNoStartAndNoLimitsOver) {
  Slow controller(100'000);
  Planner planner(controller, 0.008, Still(), std::vector<MotorLimits>(1));
  planner.PostStart(Still());
  planner.PostUpdate(0, 0.0, Still(), VectorX::Zero(1));
  SleepFor(30'000);  // it is at it
  std::vector<MotorLimits> lost(1);
  lost[0].max_tension_n = 0;
  planner.SetLimits(lost);
  planner.PostUpdate(5, 0.05, Still(), VectorX::Zero(1));
  planner.PostUpdate(10, 0.10, Still(), VectorX::Zero(1));
  planner.PostStart(Still());
  planner.PostUpdate(15, 0.15, Still(), VectorX::Zero(1));
  Await(planner, 15);
  planner.Stop();
  EXPECT_EQ(controller.calls(), (std::vector<std::string>{"start", "update 0", "lost", "update 10",
                                                          "start", "update 15"}));
  EXPECT_EQ(planner.counters().overtaken, 1);
}

TEST(Planner, OneThatIsStuckHoldsNobodyUp) {
  Slow controller(300'000);
  Planner planner(controller, 0.008, Still(), std::vector<MotorLimits>(1));
  planner.PostUpdate(0, 0.0, Still(), VectorX::Zero(1));
  SleepFor(30'000);
  const std::int64_t begin_us = MonotonicTime_us();
  for (long k = 1; k <= 100; ++k) planner.PostUpdate(k, 0.01, Still(), VectorX::Zero(1));
  EXPECT_LT(MonotonicTime_us() - begin_us, 200'000);
  planner.Stop();
  EXPECT_GT(planner.counters().refused, 0);
}

}  // namespace
}  // namespace mantle::loop
