#include "loop/closed_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "loop/scene/scene.h"
#include "tests/support/paths.h"

namespace mantle::loop {
namespace {

scene::Scene Reach(std::vector<std::string> overrides = {}) {
  overrides.push_back("time.duration=0.5");
  return scene::LoadScene(tests::SourcePath("scenes/reach.toml"), overrides);
}
constexpr int kCycles = 50, kCyclesPerPlan = 5;

TEST(ClosedLoop, TheObserverSeesEverySyncAndTheEnd) {
  ClosedLoop loop(Reach());
  std::vector<double> times;
  int plans = 0;
  const LoopResult r = loop.Run([&](const LoopStep& step) {
    times.push_back(step.time_s);
    plans += step.planned ? 1 : 0;
    return true;
  });
  ASSERT_TRUE(r.ok) << r.reason;
  ASSERT_EQ(times.size(), kCycles + 1U);
  for (int k = 0; k <= kCycles; ++k) EXPECT_NEAR(times[k], 0.01 * k, 1e-12);
  EXPECT_EQ(plans, kCycles / kCyclesPerPlan);
  EXPECT_EQ(r.solve_s.size(), static_cast<std::size_t>(plans));
  EXPECT_EQ(r.cycles, kCycles);
  EXPECT_DOUBLE_EQ(r.time_s, 0.5);
  EXPECT_DOUBLE_EQ(r.plant.sim_time_s, 0.5) << "taking the drives down is not part of the run";
}

TEST(ClosedLoop, AnObserverMayEndTheRunAndTheDrivesAreTakenDown) {
  ClosedLoop loop(Reach());
  const LoopResult r = loop.Run([](const LoopStep& step) { return step.time_s < 0.2 - 1e-9; });
  EXPECT_TRUE(r.ok) << r.reason;
  EXPECT_EQ(r.cycles, 20);
  const MotorMaster& motors = loop.control_side().motors();
  EXPECT_TRUE(motors.stopped());
  for (int i = 0; i < motors.motor_count(); ++i) {
    EXPECT_EQ(motors.report(i).step, firmware_sim::DriveStep::kStopped);
  }
}

TEST(ClosedLoop, PlantWorkAndWinchWorkAgreeButForTheCables) {
  ClosedLoop loop(Reach());
  const LoopResult r = loop.Run();
  ASSERT_TRUE(r.ok) << r.reason;
  double on_plant_j = 0;
  for (std::size_t i = 0; i < r.plant.work_names.size(); ++i) {
    if (r.plant.work_names[i].starts_with("cable.")) on_plant_j += r.plant.work_j[i];
  }
  EXPECT_GT(on_plant_j, 0.0);
  // Stretch and damping of the cables, and what the drums got back.
  EXPECT_NEAR(r.cable_work_j, on_plant_j, 0.2 * r.cable_work_j);
}

TEST(ClosedLoop, MismatchIsThePlantsAlone) {
  const scene::Scene scene = Reach({"mismatch.young=1.2", "mismatch.drag=1.5"});
  ClosedLoop loop(scene);
  const double believed = scene.robot.arms[0].material.young_pa;
  EXPECT_EQ(loop.reduced().plant.robot.arms[0].material.young_pa, believed);
  EXPECT_DOUBLE_EQ(loop.plant().robot.arms[0].material.young_pa, 1.2 * believed);
  const auto drag = [](const model::Plant& plant) {
    for (const model::SectionLoad& load : plant.rods[0].loads) {
      if (const auto* d = std::get_if<model::DragLoad>(&load)) return d->coefficients.y();
    }
    return 0.0;
  };
  EXPECT_EQ(drag(loop.reduced().plant), scene.robot.arms[0].drag_coefficients.y());
  EXPECT_DOUBLE_EQ(drag(loop.plant()), 1.5 * scene.robot.arms[0].drag_coefficients.y());
}

TEST(ClosedLoop, EveryKeyOfMismatchReachesThePlant) {  // what each does: model.mismatch
  const model::Mismatch m =
      PlantRobot(Reach({"mismatch.young=1.1", "mismatch.viscosity=1.2", "mismatch.drag=1.3",
                        "mismatch.added_mass=1.4", "mismatch.jet=1.5"}))
          .mismatch;
  EXPECT_EQ(m.young, 1.1);
  EXPECT_EQ(m.viscosity, 1.2);
  EXPECT_EQ(m.drag, 1.3);
  EXPECT_EQ(m.added_mass, 1.4);
  EXPECT_EQ(m.jet, 1.5);
}

TEST(ClosedLoop, RefusesScenesThatAreNoClosedLoop) {
  scene::Scene without = Reach();
  without.control.reset();
  EXPECT_THROW(ClosedLoop{without}, scene::BadScene);
  EXPECT_THROW(ClosedLoop{Reach({"drives.period=0.03"})}, scene::BadScene)
      << "50 ms are no multiple of 30 ms";
}

}  // namespace
}  // namespace mantle::loop
