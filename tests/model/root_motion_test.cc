#include "model/root_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

/// A prescribed root moves every body alike: start, schedules of every kind, kinks, currents.

namespace mantle::model {
namespace {

using tests::CompleteRun;
using tests::Settings;

constexpr double kPi = std::numbers::pi;

Robot RootedArm(const RootMotion& root) {
  Robot robot;
  robot.name = "arm";
  robot.root = root;
  robot.arms = {tests::PaperArm(8)};
  robot.effects.viscosity = true;
  return robot;
}

Robot RootedMantle(const RootMotion& root) {
  Robot robot;
  robot.name = "mantle";
  robot.root = root;
  robot.mantle = tests::PaperMantle(24, 3);
  robot.effects.viscosity = true;
  return robot;
}

// Arm, mantle and cone with every effect but the jet, whose scene a rooted vehicle is not.
Robot RootedVehicle(const RootMotion& root) {
  Robot robot = tests::PaperRobot(8, 24);
  robot.name = "vehicle";
  robot.root = root;
  robot.effects = tests::EveryEffect();
  robot.effects.jet_thrust.reset();
  robot.arms[0].material.density_kg_m3 = 1100;
  return robot;
}

PrescribedRoot Along(int axis, Schedule schedule) {
  PrescribedRoot root;
  (axis == 0 ? root.x_m : axis == 1 ? root.y_m : root.z_m) = std::move(schedule);
  return root;
}

PrescribedRoot Turning(Schedule angle, const Vector3& axis = Vector3::UnitZ()) {
  PrescribedRoot root;
  root.angle_rad = std::move(angle);
  root.rotation_axis = axis;
  return root;
}

// Knots of a sine from its start: piecewise linear, off by (w dt)^2 / 8 of the amplitude.
TableSchedule Sampled(const SineSchedule& sine, double end_s, int pieces) {
  TableSchedule table;
  for (int k = 0; k <= pieces; ++k) {
    const double t = end_s * k / pieces;
    table.time_s.push_back(t);
    table.value.push_back(Value(sine, t));
  }
  return table;
}

struct Track {
  std::vector<double> volume_m3;
  std::vector<Vector3> tip_m;
  RunResult result;
};

Track Follow(const Robot& robot, const RunSettings& settings) {
  const Plant plant(robot);
  Simulation simulation(plant, settings);
  Track track;
  track.result = simulation.Run([&](const Sample& s) {
    track.volume_m3.push_back(s.volume_m3);
    if (!s.tips.empty()) track.tip_m.push_back(s.tips[0].position);
    return true;
  });
  EXPECT_TRUE(track.result.ok) << track.result.reason;
  return track;
}

double Largest(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    worst = std::max(worst, std::abs(a[i] - b[i]));
  }
  return worst;
}

double Largest(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    worst = std::max(worst, (a[i] - b[i]).norm());
  }
  return worst;
}

double Spread(const std::vector<double>& x) {
  return *std::max_element(x.begin(), x.end()) - *std::min_element(x.begin(), x.end());
}

TEST(RootMotion, BodiesStartAtRestInTheirShapeWhereverTheRootStarts) {
  // Held aside, turned nearly round, phase-shifted, in a turned pose: nothing is strained at t = 0,
  // and where the root is held nothing ever is.
  Pose turned;
  turned.rotation = ExpSO3(Vector3(0.4, -0.7, 0.2));
  turned.position = {0.3, -0.1, 0.2};
  const struct {
    const char* name;
    PrescribedRoot root;
  } cases[] = {{"aside", Along(1, ConstantSchedule{0.02})},
               {"turned round", Turning(ConstantSchedule{170 * kPi / 180}, Vector3::UnitX())},
               {"table from elsewhere", Along(2, TableSchedule{{1.0, 2.0}, {-0.4, 0.4}})},
               {"sine that has not begun", Along(0, SineSchedule{0.1, 1.0, kPi / 2, 0.05, 5.0})}};
  for (const auto& c : cases) {
    for (const Pose& pose : {Pose::Identity(), turned}) {
      Robot robot = tests::PaperRobot(8, 24);
      robot.root = c.root;
      robot.root_pose = pose;
      robot.effects.viscosity = true;
      RunSettings settings = Settings(Integrator::kSdirk2, 0.02, 0.1);
      const Plant plant(robot);
      Simulation simulation(plant, settings);
      const Sample start = simulation.Observe();
      constexpr double kRoundOff_j = 1e-20;
      EXPECT_LT(start.energies.total(), kRoundOff_j) << c.name;
      ASSERT_TRUE(simulation.AdvanceTo(0.1).ok) << c.name;
      EXPECT_LT(simulation.Observe().energies.total(), kRoundOff_j) << c.name;
    }
  }
}

TEST(RootMotion, BodiesStartMovingWithTheRoot) {
  // A rigid motion of the whole robot: kinetic energy of a rigid body and no rate of strain.
  Robot robot = tests::PaperRobot(8, 24);
  robot.root = Turning(SineSchedule{0.5, 1.0, 0.3, 0.2, 0.0}, Vector3(1, 2, 2) / 3.0);
  std::get<PrescribedRoot>(robot.root).x_m = SineSchedule{0.1, 2.0, 0.1, 0.0, 0.0};
  robot.effects.viscosity = true;
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.01, 0.1));
  const Sample s = simulation.Observe();
  const Pose from_root = Inverse(s.root) * s.tips[0];
  EXPECT_GT(s.root_twist.norm(), 1.0);
  EXPECT_LT((AdjointInverseTimes(from_root, s.root_twist) - s.tip_twists[0]).norm(), 1e-13);
  EXPECT_LT(std::abs(s.volume_rate_m3_s), 1e-18);
  EXPECT_LT(s.energies.elastic_arms_j + s.energies.elastic_mantle_j, 1e-20);
}

TEST(RootMotion, TowedIsHeldInACurrent) {
  // Towing through still water and being held in a stream differ by a change of inertial frame.
  const double speed = 0.3, duration = 0.4;
  const TableSchedule ramp{{0.0, 10.0}, {0.0, 10.0 * speed}};
  const TriangularSchedule wave{0.0, 10.0 * speed, 20.0, 0.0};
  for (int axis : {0, 2}) {
    Robot held = RootedVehicle(ClampedRoot{});
    held.effects.current_m_s = -speed * Vector3::Unit(axis);
    const RunSettings settings = Settings(Integrator::kSdirk2, 0.01, duration);
    const Plant plant(held);
    Simulation simulation(plant, settings);
    ASSERT_TRUE(simulation.AdvanceTo(duration).ok);
    const Sample stream = simulation.Observe();
    for (const Schedule& schedule : {Schedule(ramp), Schedule(wave)}) {
      Robot towed = held;
      towed.effects.current_m_s.reset();
      towed.root = Along(axis, schedule);
      const Plant moving(towed);
      Simulation tow(moving, settings);
      ASSERT_TRUE(tow.AdvanceTo(duration).ok);
      const Sample s = tow.Observe();
      const Vector3 carried = speed * duration * Vector3::Unit(axis);
      constexpr double kRoundOff_m = 1e-11;  // of Newton's iteration, over the run
      EXPECT_LT((s.tips[0].position - carried - stream.tips[0].position).norm(), kRoundOff_m);
      EXPECT_NEAR(s.volume_m3, stream.volume_m3, 1e-12);
      EXPECT_GT(stream.energies.elastic_arms_j, 1e-7) << "the stream bends the arm";
    }
  }
}

TEST(RootMotion, ATableMovesEveryBodyAsTheCurveItSamples) {
  // The table's kinks carry impulses, whose sum is the curve's acceleration: both converge to the
  // same motion, with the square of the knots' distance.
  const SineSchedule sine{0.01, 4.0, 0.0, 0.0, 0.0};
  const SineSchedule swing{0.3, 2.0, 0.0, 0.0, 0.0};
  const double end = 0.25;
  const auto settings = [&] {
    RunSettings s = Settings(Integrator::kSdirk3, 0.25 / 80, end);
    s.output_interval_s = end / 10;
    return s;
  };
  const auto check = [&](const char* name, auto robot_of, const SineSchedule& curve, auto root_of,
                         auto signal) {
    const auto track = [&](const Schedule& s) {
      return signal(Follow(robot_of(RootMotion(root_of(s))), settings()));
    };
    const auto smooth = track(curve);
    const double coarse = Largest(track(Sampled(curve, end, 10)), smooth);
    const double fine = Largest(track(Sampled(curve, end, 20)), smooth);
    const auto at_rest = track(ConstantSchedule{Value(curve, 0.0)});
    EXPECT_LT(fine, 0.05 * Largest(smooth, at_rest)) << name;
    EXPECT_GT(coarse / fine, 3.0) << name << ": " << coarse << ", " << fine;
  };
  const auto volume = [](const Track& t) { return t.volume_m3; };
  const auto tip = [](const Track& t) { return t.tip_m; };
  const auto along = [](int axis) { return [axis](const Schedule& s) { return Along(axis, s); }; };
  check("mantle along its axis", RootedMantle, sine, along(2), volume);
  check("arm across", RootedArm, sine, along(0), tip);
  check(
      "arm turned", RootedArm, swing,
      [](const Schedule& s) { return Turning(s, Vector3::UnitY()); }, tip);
  check("vehicle along its axis", RootedVehicle, sine, along(2), volume);
}

TEST(RootMotion, JumpingRootSpeedShakesTheMantle) {
  // The root rises by 10 mm and falls back: every schedule that says so moves the volume, alike.
  const TableSchedule table{{0.0, 0.1, 0.2, 1.0}, {0.0, 0.01, 0.0, 0.0}};
  const TriangularSchedule wave{0.0, 0.01, 0.2, 0.0};  // the same until 0.2 s
  RunSettings settings = Settings(Integrator::kSdirk2, 0.005, 0.2);
  const Track by_table = Follow(RootedMantle(Along(2, table)), settings);
  const Track by_wave = Follow(RootedMantle(Along(2, wave)), settings);
  EXPECT_GT(Spread(by_table.volume_m3), 1e-6)
      << "1 mL of 322: it moves by no less than its inertia";
  EXPECT_LT(Largest(by_table.volume_m3, by_wave.volume_m3), 1e-14);
  settings.step_s = 0.0025;
  const Track fine = Follow(RootedMantle(Along(2, table)), settings);
  EXPECT_LT(std::abs(fine.volume_m3.back() - by_table.volume_m3.back()),
            0.02 * Spread(fine.volume_m3));
}

TEST(RootMotion, EveryIntegratorCrossesKinksAlike) {
  const TableSchedule jerky{{0.0, 0.03, 0.07, 0.1}, {0.0, 0.004, -0.003, 0.0}};
  const auto end = [&](const Robot& robot, Integrator integrator, double step) {
    RunSettings settings = Settings(integrator, step, 0.1);
    settings.output_interval_s = 0.01;
    settings.stepper.relative_tolerance = 1e-9;
    settings.stepper.absolute_tolerance = 1e-11;
    return Follow(robot, settings);
  };
  for (const Robot& robot : {RootedMantle(Along(2, jerky)), RootedArm(Along(1, jerky))}) {
    const Track reference = end(robot, Integrator::kCvode, 0.01);
    const double volume = std::max(Spread(reference.volume_m3), 1e-9);
    for (Integrator integrator : {Integrator::kSdirk2, Integrator::kSdirk3}) {
      const Track track = end(robot, integrator, 0.0005);
      EXPECT_LT(Largest(track.volume_m3, reference.volume_m3), 2e-3 * volume);
      EXPECT_LT(Largest(track.tip_m, reference.tip_m), 1e-5);
    }
  }
}

TEST(RootMotion, ImpulsesOfTheSupportAreAccounted) {
  const TableSchedule jerky{{0.0, 0.05, 0.1, 0.15}, {0.0, 0.004, -0.003, 0.0}};
  Robot robot = RootedVehicle(Along(2, jerky));
  std::get<PrescribedRoot>(robot.root).y_m = jerky;
  const auto drift = [&](double step) {
    const RunResult r = CompleteRun(robot, Settings(Integrator::kSdirk2, step, 0.2));
    EXPECT_LT(r.power_balance_residual, 1e-10);
    return r.energy_drift;
  };
  const double coarse = drift(0.002), fine = drift(0.001);
  EXPECT_LT(fine, 1e-2);
  EXPECT_LT(fine, 0.5 * coarse) << "what is left is the step's error";
}

TEST(RootMotion, OutputTimesThatMissAKinkByRoundOffDoNotHideIt) {
  // 0.1 + 0.1 + 0.1 is not 0.3.
  const TableSchedule table{{0.0, 0.3, 0.6}, {0.0, 0.01, 0.0}};
  const Plant plant(RootedMantle(Along(2, table)));
  const auto volume_at = [&](double first_stop) {
    Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.005, 0.4));
    EXPECT_TRUE(simulation.AdvanceTo(first_stop).ok);
    EXPECT_TRUE(simulation.AdvanceTo(0.36).ok);
    return simulation.Observe().volume_m3;
  };
  const double whole = volume_at(0.3);
  EXPECT_GT(std::abs(whole - plant.shell->rest_volume_m3), 1e-7);
  for (double miss : {-4e-16, -5e-13, 4e-16, 5e-13}) {
    EXPECT_NEAR(volume_at(0.3 + miss), whole, 1e-13) << miss;
  }
}

TEST(RootMotion, PlacesThatJumpAreRefusedByName) {
  const auto complaint = [](const PrescribedRoot& root) -> std::string {
    try {
      Plant plant(RootedArm(root));
    } catch (const BadRobot& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(complaint(Along(1, TableSchedule{{0, 0.4, 0.4, 1}, {0, 0.1, 0.3, 0}}))
                .rfind("robot.root.y: jumps by 0.2 m at t = 0.4 s, must be continuous", 0),
            0u);
  EXPECT_EQ(
      complaint(Along(2, IntervalSchedule{0.1, {0.5}, {0.7}})).rfind("robot.root.z: jumps", 0), 0u);
  EXPECT_EQ(complaint(Turning(IntervalSchedule{0.1, {0.0}, {0.7}}))
                .rfind("robot.root.angle: jumps by -0.1 rad at t = 0.7 s", 0),
            0u);
  for (const Schedule& s : {Schedule(ConstantSchedule{0.1}), Schedule(SineSchedule{}),
                            Schedule(TriangularSchedule{}), Schedule(IntervalSchedule{0, {1}, {2}}),
                            Schedule(TableSchedule{{0, 1, 1, 2}, {0, 1, 1, 0}})}) {
    EXPECT_EQ(complaint(Along(0, s)), "accepted");
  }
}

}  // namespace
}  // namespace mantle::model
