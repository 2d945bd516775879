#include <gtest/gtest.h>

#include <limits>

#include "loop/closed_loop.h"
#include "loop/scene/scene.h"
#include "tests/support/paths.h"

// Measurements that cannot be: a plant whose instruments once say nonsense.

namespace mantle::loop {
namespace {

constexpr double kWild = 5.0;
constexpr int kWildCycle = 20, kCycles = 200, kPlans = 40;

/// The scene's plant, whose measurement of all shape coordinates is off in given cycles.
class Dazed final : public VehicleSide {
 public:
  Dazed(const VehicleParts& parts, const scene::Scene& scene)
      : plant_(PlantRobot(scene)),
        model_(BelievedRobot(scene), scene.reduction),
        vehicle_(plant_, model_, scene.run, parts.motors, parts.drives, parts.sensors, parts.bus) {}

  void Pump(std::int64_t now_us) override { vehicle_.Pump(now_us); }
  void Hold(std::int64_t now_us) override { vehicle_.Hold(now_us); }
  void Release(std::int64_t now_us) override { vehicle_.Release(now_us); }
  Status Advance(std::int64_t now_us) override { return vehicle_.Advance(now_us); }
  int coupling_steps() const override { return vehicle_.coupling_steps(); }
  bool braked() const override { return vehicle_.braked(); }
  Status Look(double time_s) override { return vehicle_.Look(time_s); }
  void Measure(Sensors* message) override {
    vehicle_.Measure(message);
    if (cycle_ >= from && cycle_ < until) message->state.q.array() += size;
    ++cycle_;
  }
  const reduced::ReducedState& truth() const override { return vehicle_.truth(); }
  const model::VectorX& tension_n() const override { return vehicle_.tension_n(); }
  model::Vector3 tip(int arm) const override { return vehicle_.tip(arm); }
  double cable_work_j(int motor) const override { return vehicle_.cable_work_j(motor); }

  static inline int from = 0, until = 0;  ///< cycles
  static inline double size = kWild;

 private:
  model::Plant plant_;
  reduced::ReducedPlant model_;
  PlantVehicle vehicle_;
  int cycle_{0};
};

scene::Scene Steer(std::vector<std::string> overrides) {
  for (const char* o : {"time.duration=2", "mantle.elements=16", "arms.arm.elements=8"}) {
    overrides.emplace_back(o);
  }
  return scene::LoadScene(tests::SourcePath("scenes/steer.toml"), overrides);
}

LoopResult RunDazed(int from, int until, std::vector<std::string> overrides = {},
                    double size = kWild) {
  static const bool registered = [] {
    RegisterVehicle({"dazed", [](const VehicleParts& parts) {
                       return std::make_unique<Dazed>(parts, Steer({}));
                     }});
    return true;
  }();
  EXPECT_TRUE(registered);
  Dazed::from = from;
  Dazed::until = until;
  Dazed::size = size;
  overrides.emplace_back("drives.vehicle=\"dazed\"");
  ClosedLoop loop(Steer(overrides));
  return loop.Run();
}

long Fallbacks(const LoopResult& r) {
  return static_cast<long>(r.counters.shifted + r.counters.safe);
}

TEST(WildMeasurement, OneIsRefusedAndChangesNothingToSpeakOf) {
  const LoopResult good = RunDazed(0, 0), dazed = RunDazed(kWildCycle, kWildCycle + 1);
  ASSERT_TRUE(dazed.ok) << dazed.reason;
  EXPECT_EQ(good.estimator.refused, 0);
  EXPECT_EQ(good.estimator.taken, kCycles - 1) << "all but the first, from which it starts";
  EXPECT_EQ(dazed.estimator.refused, 1);
  EXPECT_EQ(dazed.estimator.taken, kCycles - 2);
  EXPECT_EQ(dazed.counters.solves, static_cast<unsigned>(kPlans));
  EXPECT_EQ(Fallbacks(dazed), 0);
  EXPECT_EQ(dazed.ended, "");
  EXPECT_NEAR(dazed.cost, good.cost, 0.02 * good.cost);
}

TEST(WildMeasurement, WithoutAGateTheControllerRecoversWithTheNextGoodOne) {
  // No filter, so no gate: the estimate itself is wild, when a plan is made.
  const std::vector<std::string> bare = {"control.estimator.disturbance=false"};
  const LoopResult good = RunDazed(0, 0, bare), dazed = RunDazed(kWildCycle, kWildCycle + 1, bare);
  ASSERT_TRUE(dazed.ok) << dazed.reason;
  EXPECT_LE(Fallbacks(dazed), 1) << "the plan of that instant alone";
  EXPECT_GE(dazed.counters.restarts, 1U);
  EXPECT_EQ(dazed.ended, "");
  EXPECT_NEAR(dazed.cost, good.cost, 0.05 * good.cost);
}

TEST(WildMeasurement, ThatCannotBeRolledAndDoesNotEndEndsTheRunOnFallbacksAndItSaysSo) {
  const LoopResult r = RunDazed(kWildCycle, std::numeric_limits<int>::max(),
                                {"control.estimator.disturbance=false"}, 1e3);
  ASSERT_TRUE(r.ok) << r.reason;
  EXPECT_GT(Fallbacks(r), kPlans / 2);
  EXPECT_NE(r.ended.find("ended on fallbacks"), std::string::npos)
      << r.ended << "; of " << r.counters.solves << " plans " << r.counters.solved << " solved, "
      << r.counters.stopped_better << " stopped, " << r.counters.shifted << " shifted, "
      << r.counters.safe << " safe, in turn " << r.counters.fallbacks_in_turn;
}

TEST(WildMeasurement, AGateDoesNotRefuseForEver) {
  const LoopResult r = RunDazed(kWildCycle, std::numeric_limits<int>::max());
  EXPECT_GE(r.estimator.restarts, 1);
  EXPECT_GT(r.estimator.refused, 5);
}

}  // namespace
}  // namespace mantle::loop
