#include "firmware_sim/drive/drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Frame;
using test::Hauling;
using test::Targets;

TEST(Drive, NodeOutsideItsBoundIsRefusedWithTheBound) {
  for (const NodeId node : {NodeId{0}, NodeId{127}, NodeId{200}}) {
    try {
      Drive drive({.node = node}, 0);
      FAIL() << int{node};
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("outside 1..126"), std::string::npos);
    }
  }
}

TEST(Drive, ItsClockDoesNotDependOnHowItIsAdvanced) {
  const auto run = [](std::int64_t slice_us) {
    DriveBench bench;
    bench.Enable(Hauling());
    const std::int64_t end_us = bench.now_us + 90'000;
    while (bench.now_us < end_us) bench.Advance(slice_us);
    return bench.drive.winch().angle_rad();
  };
  const double whole = run(90'000);
  EXPECT_NE(whole, 0.0);
  for (const std::int64_t slice_us : {30LL, 100LL, 900LL, 1000LL, 9000LL}) {
    EXPECT_EQ(run(slice_us), whole) << slice_us;
  }
}

TEST(Drive, SyncMovesNoClock) {
  DriveBench bench;
  bench.Enable(Hauling());
  const std::int64_t now_us = bench.drive.now_us();
  const double angle_rad = bench.drive.winch().angle_rad();
  for (int i = 0; i < 1000; ++i) bench.Sync();
  EXPECT_EQ(bench.drive.now_us(), now_us);
  EXPECT_EQ(bench.drive.winch().angle_rad(), angle_rad);
}

TEST(Drive, TimeThatGoesBackIsHeldStill) {
  DriveBench bench;
  bench.Advance(50'000);
  bench.drive.AdvanceTo(10'000);
  bench.drive.OnFrame(Frame(0x000, {1, 0}), 20'000);
  EXPECT_EQ(bench.drive.now_us(), 50'000);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kOperational);
}

TEST(Drive, AQueueNobodyEmptiesStopsGrowingAndCounts) {
  Drive drive({}, 0);
  drive.AdvanceTo(20'000'000);  // 200 heartbeats
  EXPECT_EQ(drive.frames_dropped(), 201 - CanopenNode::kOutCapacity);
  CanFrame frame;
  std::size_t taken = 0;
  while (drive.TakeFrame(frame)) ++taken;
  EXPECT_EQ(taken, CanopenNode::kOutCapacity);
}

TEST(Drive, ACableThatIsNoCableIsRefused) {
  DriveBench bench(DriveConfig{.cable = {0.5, 0.0, 0.0}});
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Drive({.cable = {0.0, kNan, 0.0}}, 0), std::invalid_argument);
  EXPECT_FALSE(bench.drive.SetCable({kNan, 0.0, 0.0}));
  EXPECT_FALSE(bench.drive.SetCable({0.0, kInf, 0.0}));
  EXPECT_FALSE(bench.drive.SetCable({0.0, 1.0, kNan}));
  EXPECT_FALSE(bench.drive.SetCable({0.0, -1.0, 0.0}));
  bench.Advance(1'000);
  EXPECT_EQ(bench.drive.output().tension_n, 0.5);  // the last good one
  EXPECT_TRUE(bench.drive.SetCable({0.25, 100.0, 0.0}));
  bench.Advance(1'000);
  EXPECT_NEAR(bench.drive.output().tension_n, 0.25, 1e-9);
}

/// A plant in lock-step: a mass on a spring, pulled by the cable; T = k max(0, reeled - x).
struct MassPlant {
  static constexpr double kMass_kg = 0.2;
  static constexpr double kAnchor_n_m = 20.0;
  static constexpr double kCable_n_m = 400.0;
  double x_m{0.0};
  double v_m_s{0.0};
  double work_j{0.0};  ///< that the cable did on the mass

  CableLoad Cable(double reeled_m) const {
    // The tension where the drum is now; the drive follows it along the stiffness.
    return {kCable_n_m * (reeled_m - x_m), kCable_n_m, reeled_m};
  }
  void Step(double tension_n, double step_s) {
    const double force_n = tension_n - kAnchor_n_m * x_m - 2.0 * v_m_s;
    v_m_s += step_s * force_n / kMass_kg;
    x_m += step_s * v_m_s;
    work_j += tension_n * v_m_s * step_s;
  }
  double SpringEnergy(double reeled_m) const {
    const double stretch_m = std::max(0.0, reeled_m - x_m);
    return 0.5 * kCable_n_m * stretch_m * stretch_m;
  }
};

TEST(Drive, PlantAndWinchAgreeOnTheWorkOfTheCable) {
  constexpr std::int64_t kStep_us = 500;
  DriveBench bench;
  MassPlant plant;
  Targets t = Hauling();
  bench.Enable(t);
  t.controlword = controlword::kEnableOperation;
  const double before_j = bench.drive.output().cable_work_j;
  const double start_m = bench.drive.output().reeled_m;
  plant.x_m = start_m;
  double hardest_n = 0.0;
  for (int i = 0; i < 4000; ++i) {
    if (i % 20 == 0) {
      bench.Heartbeat();
      bench.SendTargets(t);
    }
    ASSERT_TRUE(bench.drive.SetCable(plant.Cable(bench.drive.output().reeled_m)));
    bench.Advance(kStep_us);
    plant.Step(bench.drive.output().tension_n, 1e-6 * kStep_us);
    hardest_n = std::max(hardest_n, bench.drive.output().tension_n);
  }
  const WinchOutput output = bench.drive.output();
  EXPECT_GT(hardest_n, 0.5);
  const double winch_j = output.cable_work_j - before_j;
  const double plant_j = plant.work_j + plant.SpringEnergy(output.reeled_m);
  EXPECT_GT(winch_j, 5e-3);
  // First order in the exchange step of 0.5 ms.
  EXPECT_NEAR(winch_j, plant_j, 0.05 * winch_j);
  // At rest the tension carries the anchor spring, and the torque carries the tension.
  EXPECT_NEAR(output.tension_n, MassPlant::kAnchor_n_m * plant.x_m, 0.02);
}

}  // namespace
}  // namespace mantle::firmware_sim
