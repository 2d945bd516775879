#include "model/buckling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model/statics.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

namespace mantle::model {
namespace {

// A column of EI = 1 and length 1, nearly inextensible, under a push of `newton` at its tip.
Robot Column(double newton, int elements) {
  Robot robot = tests::ClampedRod(1.0, (Vector6() << 1, 1, 1, 1e6, 1e6, 1e6).finished(), elements);
  robot.arms[0].points = {
      tests::TipLoad(robot.arms[0], Vector3::Zero(), Vector3(-newton, 0, 0), LoadFrame::kWorld)};
  return robot;
}

TEST(Buckling, OfAColumnIsEulers) {
  // (2k - 1)^2 pi^2 / 4 EI / L^2 clamped and free; second order in the mesh, (k h)^2 / 12.
  // After extrapolation: the mesh's fourth order, and the column's shortening by P / EA = 6e-5.
  constexpr double kTolerance = 1e-7, kShortening = 6e-5;
  for (double newton : {1e-3, 1.0, 1e3}) {
    const BucklingResult coarse = FindBucklingLoads(Plant(Column(newton, 40)), 0.0, 3);
    const BucklingResult fine = FindBucklingLoads(Plant(Column(newton, 80)), 0.0, 3);
    ASSERT_TRUE(coarse.ok && fine.ok) << coarse.reason << fine.reason;
    ASSERT_EQ(fine.loads.size(), 3u);
    for (int k : {0, 1, 2}) {
      const double euler = std::pow((2 * k + 1) * M_PI / 2, 2);
      const double found =
          newton * tests::Extrapolate(coarse.loads[k].load_factor, fine.loads[k].load_factor);
      EXPECT_NEAR(found / euler, 1.0, kTolerance * std::pow(2 * k + 1, 4) + kShortening) << k;
    }
  }
}

TEST(Buckling, OfAPulledRodIsByTheOppositeLoad) {
  const BucklingResult found = FindBucklingLoads(Plant(Column(-1.0, 40)), 0.0, 1);
  ASSERT_TRUE(found.ok) << found.reason;
  ASSERT_EQ(found.loads.size(), 1u);
  EXPECT_NEAR(found.loads[0].load_factor, -M_PI * M_PI / 4, 1e-2);
}

TEST(Buckling, IsWhereTheStaticPathBifurcates) {
  const Plant plant(Column(5.0, 20));
  const BucklingResult linear = FindBucklingLoads(plant, 0.0, 1);
  StaticsSettings settings;
  settings.load_steps = 20;
  const StaticsResult path = SolveStatics(plant, settings);
  ASSERT_TRUE(linear.ok && path.ok);
  ASSERT_FALSE(path.bifurcation_load_factors.empty());
  // Located to a thousandth of a load step of 1/20.
  EXPECT_NEAR(linear.loads[0].load_factor, path.bifurcation_load_factors[0], 1e-4);
}

TEST(Buckling, NothingBucklesWithoutLoads) {
  Robot robot = Column(1.0, 10);
  robot.arms[0].points.clear();
  const BucklingResult found = FindBucklingLoads(Plant(robot), 0.0, 2);
  EXPECT_TRUE(found.ok) << found.reason;
  EXPECT_TRUE(found.loads.empty());
}

}  // namespace
}  // namespace mantle::model
