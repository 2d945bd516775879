#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "controller/registry.h"
#include "firmware_sim/bus/socket_time.h"
#include "loop/closed_loop.h"
#include "loop/scene/scene.h"
#include "tests/support/paths.h"

// Both sides and the planner in threads of their own, by the wall clock. The machine may be busy:
// what depends on its times is claimed only of what was in time, and the counts say what was not.

namespace mantle::loop {
namespace {

scene::Scene Reach(const std::string& controller, const std::string& duration = "1") {
  return scene::LoadScene(
      tests::SourcePath("scenes/reach.toml"),
      {"time.duration=" + duration, "control.controller=\"" + controller + "\""});
}

struct Command {
  double time_s;
  model::VectorX tension_n;
};

LoopResult RunIt(const scene::Scene& scene, bool real_time, std::vector<Command>* commands) {
  ClosedLoopOptions options;
  options.real_time = real_time;
  ClosedLoop loop(scene, options);
  return loop.Run([&](const LoopStep& step) {
    commands->push_back({step.time_s, step.command_n});
    return true;
  });
}

TEST(RealTime, DecidesAsLockStepDoesWhereNothingIsLate) {
  for (const char* controller : {"mpc", "pid"}) {
    std::vector<Command> simulated, timed;
    const LoopResult a = RunIt(Reach(controller), false, &simulated);
    const LoopResult b = RunIt(Reach(controller), true, &timed);
    ASSERT_TRUE(a.ok && b.ok) << a.reason << b.reason;
    ASSERT_TRUE(b.real_time);
    const FastLoopCounters& fast = b.real_time->control;
    // The last one may fall beyond the end.
    EXPECT_LE(std::labs(fast.cycles + fast.missed_cycles - 100), 1);
    EXPECT_GE(b.wall_s, 1.0);
    const bool late = fast.late_cycles + fast.missed_cycles + fast.predicted +
                          b.real_time->late_plans + b.real_time->plant.late_periods >
                      0;
    if (late) {
      std::printf("%s: late, nothing to compare\n", controller);
      continue;
    }
    ASSERT_EQ(timed.size(), simulated.size());
    // The bring-up is not at the same instants: the slack's end is found some counts of the encoder
    // off, 2 mN each. A plan or a SYNC that is a period off would be 20 mN, at the motors' 2 N/s.
    constexpr double kAlike_n = 1e-2;
    for (std::size_t k = 0; k + 1 < timed.size(); ++k) {
      EXPECT_LT((timed[k].tension_n - simulated[k].tension_n).cwiseAbs().maxCoeff(), kAlike_n)
          << controller << ", t = " << timed[k].time_s;
    }
  }
}

/// A planner that hangs in its fourth plan until the run is over.
class Hangs final : public controller::Controller {
 public:
  explicit Hangs(const controller::ControllerParts& parts) : parts_(parts) {}
  void Update(double, const controller::ReducedState*, const Eigen::Ref<const model::VectorX>&,
              std::int64_t) override {
    if (++plans_ == 4) firmware_sim::SleepFor(1'500'000);
  }
  void Command(double, const controller::ReducedState*,
               Eigen::Ref<model::VectorX> tensions) override {
    tensions.setConstant(0.3);
  }
  bool plans_apart() const override { return true; }

 private:
  controller::ControllerParts parts_;
  int plans_{0};
};

TEST(RealTime, APlannerThatHangsHoldsNoSyncUpAndItsMotorsLetGo) {
  controller::RegisterController({"hangs", [](const controller::ControllerParts& parts) {
                                    return std::make_unique<Hangs>(parts);
                                  }});
  std::vector<Command> commands;
  const scene::Scene scene = Reach("hangs", "1.4");
  const LoopResult r = RunIt(scene, true, &commands);
  ASSERT_TRUE(r.ok) << r.reason;
  ASSERT_TRUE(r.real_time);
  // A last SYNC that comes late may fall beyond the end.
  EXPECT_LE(std::labs(r.real_time->control.cycles + r.real_time->control.missed_cycles - 140), 1);
  EXPECT_GE(r.real_time->late_plans, 1);
  EXPECT_GT(r.real_time->stuck_cycles, 0);
  const double low = scene.control->motors[0].min_tension_n;
  EXPECT_NEAR(commands[40].tension_n(0), 0.3, 1e-9) << "the old plan went on";
  EXPECT_NEAR(commands.back().tension_n(0), low, 1e-9);
}

TEST(RealTime, AnObserverMayEndItAndTheDrivesAreTakenDown) {
  ClosedLoopOptions options;
  options.real_time = true;
  ClosedLoop loop(Reach("pid", "5"), options);
  long seen = 0;
  const LoopResult r = loop.Run([&](const LoopStep&) { return ++seen < 20; });
  EXPECT_TRUE(r.ok) << r.reason;
  EXPECT_LT(r.time_s, 1.0);
  EXPECT_TRUE(loop.control_side().motors().stopped());
}

}  // namespace
}  // namespace mantle::loop
