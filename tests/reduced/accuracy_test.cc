#include "tests/reduced/accuracy.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "loop/scene/scene.h"
#include "reduced/build/reduced_plant.h"
#include "tests/support/paths.h"

namespace mantle::reduced {
namespace {

Reduction Segments(int n, const StrainChoice& strains) {
  Reduction r;
  r.arms[0].segments = n;
  r.arms[0].strains = strains;
  return r;
}

// Published errors stand with two figures, of other meshes and an other torque's timing.
constexpr double kPublishedShare = 0.2;
// The plant's mesh and the step, in L, where the published errors are that small themselves.
constexpr double kMesh = 3e-4;

TEST(ReducedAccuracy, StaticArmHasThePublishedErrors) {
  const model::Robot robot = tests::ArmWithCable(1.0);
  const model::PlantState full = tests::FullEquilibrium(robot);
  // [physics.md] 8
  for (const auto& [n, published] :
       {std::pair{1, 0.23}, {2, 0.065}, {3, 0.024}, {4, 0.011}, {6, 0.0036}}) {
    const double six = tests::StaticTipError(robot, Segments(n, kSixStrains), full);
    EXPECT_NEAR(six, published, kPublishedShare * published + kMesh) << n << " segments";
    const double four = tests::StaticTipError(robot, Segments(n, kFourStrains), full);
    EXPECT_LT(four, 1.25 * six + kMesh) << n << " segments: four strains lose 10 to 25 %";
  }
}

TEST(ReducedAccuracy, MovingArmHasThePublishedErrors) {
  const model::Robot robot = tests::ArmWithTorque();
  const auto full = tests::FullRun(robot, 3.0);
  constexpr double kStep_s = 0.01;
  for (const auto& [n, published] :
       {std::pair{1, 0.025}, {2, 0.0076}, {3, 0.0044}, {4, 0.0027}, {6, 0.0013}}) {
    const Reduction six = Segments(n, kSixStrains);
    EXPECT_NEAR(tests::ErrorsOfRun(robot, six, kStep_s, full).tip, published,
                kPublishedShare * published + kMesh)
        << n << " segments";
    const Reduction four = Segments(n, kFourStrains);
    EXPECT_LT(tests::ErrorsOfRun(robot, four, 0.05, full).tip, 1.25 * published + 2 * kMesh)
        << n << " segments, four strains, steps of 50 ms";
  }
}

TEST(ReducedAccuracy, CubicPolynomialsBeatSegmentsAtEqualUnknowns) {
  Reduction cubic;
  cubic.arms[0].basis = BasisKind::kLegendre;
  cubic.arms[0].degree = 3;
  cubic.arms[0].strains = kSixStrains;
  const Reduction constant = Segments(4, kSixStrains);
  const model::Robot bent = tests::ArmWithCable(1.0), moving = tests::ArmWithTorque();
  const model::PlantState full = tests::FullEquilibrium(bent);
  const double still = tests::StaticTipError(bent, cubic, full);
  EXPECT_NEAR(still, 0.0047, kPublishedShare * 0.0047 + kMesh);
  EXPECT_LT(still, tests::StaticTipError(bent, constant, full));
  const auto run = tests::FullRun(moving, 2.0);
  EXPECT_LT(tests::ErrorsOfRun(moving, cubic, 0.01, run).tip,
            tests::ErrorsOfRun(moving, constant, 0.01, run).tip);
}

constexpr double kVolume = 0.02;  // of its change: what is asked of three coordinates

TEST(ReducedAccuracy, ThreeMantleCoordinatesHoldTheVolume) {
  for (double pressure : {50.0, 160.0, 325.0}) {
    const model::Robot still = tests::MantleAlone(model::ConstantSchedule{pressure});
    EXPECT_LT(tests::StaticVolumeError(still, {}, tests::FullEquilibrium(still)), kVolume)
        << pressure << " Pa";
    const model::Robot pulsing =
        tests::MantleAlone(model::TriangularSchedule{0, pressure, 0.66, 0});
    const auto full = tests::FullRun(pulsing, 1.32);
    EXPECT_LT(tests::ErrorsOfRun(pulsing, {}, 0.05, full).volume, kVolume) << pressure << " Pa";
  }
}

TEST(ReducedAccuracy, VibrationModesAloneMissThePulse) {
  const model::Robot robot = tests::MantleAlone(model::ConstantSchedule{325.0});
  const model::PlantState full = tests::FullEquilibrium(robot);
  Reduction modes;
  modes.mantle.modes = 3;
  modes.mantle.static_pressures_pa.emplace();
  EXPECT_GT(tests::StaticVolumeError(robot, modes, full), 0.5);
}

TEST(ReducedAccuracy, VehicleSwimsThePapersPathWithinFivePercent) {
  const scene::Scene scene = scene::LoadScene(tests::SourcePath("scenes/paper.toml"),
                                              {"mantle.elements=128", "arms.arm.elements=80"});
  const ReducedPlant model(scene.robot, scene.reduction);
  ASSERT_EQ(model.mantle->size, 3);
  ASSERT_EQ(model.arms[0].size(), 4 * 4);
  const auto full = tests::FullRun(scene.robot, scene.run.duration_s);
  ASSERT_EQ(full.back().time_s, 9.0);
  constexpr double kPath = 0.05;  // of the body length: what is asked
  EXPECT_EQ(scene.robot.body_length_m, 0.532);
  EXPECT_LT(tests::ErrorsOfRun(scene.robot, scene.reduction, 0.05, full).root, kPath);
  EXPECT_LT(tests::ErrorsOfRun(scene.robot, scene.reduction, 0.01, full).root, kPath);
}

TEST(ReducedAccuracy, DefaultShapesSufficeAwayFromTheRunAway) {
  const scene::Scene scene =
      scene::LoadScene(tests::SourcePath("scenes/paper.toml"),
                       {"mantle.strips.muscle.pressure.high=250", "reduced.snapshots=0",
                        "reduced.static_pressures=[160, 325]", "time.duration=4"});
  const auto full = tests::FullRun(scene.robot, 4.0);
  constexpr double kPath = 0.015;  // 0.7 % measured over 9 s
  EXPECT_LT(tests::ErrorsOfRun(scene.robot, scene.reduction, 0.05, full).root, kPath);
}

}  // namespace
}  // namespace mantle::reduced
