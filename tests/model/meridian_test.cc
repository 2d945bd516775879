#include "model/meridian.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/rod.h"
#include "tests/support/paper_robot.h"

namespace mantle::model {
namespace {

using tests::kApexAngle;
using tests::kMantleRadius;
using tests::PaperMantle;

constexpr double kRoundOff = 1e-14;

TEST(Meridian, PaperMantleIsHemisphereAndCylinder) {
  const Mantle m = PaperMantle();
  EXPECT_NEAR(kApexAngle, 0.1514, 5e-5);  // [physics.md] 1: the hole in the dome
  EXPECT_NEAR(MeridianLength(m), 0.130, kRoundOff);
  for (double x : {0.0, 0.01, 0.03, 0.044}) {  // on the sphere
    const double polar = kApexAngle + x / kMantleRadius;
    const MeridianPoint p = MeridianAt(m, x);
    EXPECT_NEAR(p.r_m, kMantleRadius * std::sin(polar), kRoundOff);
    EXPECT_NEAR(p.z_m, kMantleRadius * (std::cos(polar) - std::cos(kApexAngle)), kRoundOff);
    EXPECT_NEAR(p.theta_rad, -polar, kRoundOff);
  }
  const MeridianPoint lip = MeridianAt(m, 0.130);  // down the cylinder
  EXPECT_NEAR(lip.r_m, kMantleRadius, kRoundOff);
  EXPECT_NEAR(lip.z_m, -kMantleRadius * std::cos(kApexAngle) - 0.086, kRoundOff);
  EXPECT_NEAR(lip.theta_rad, -std::numbers::pi / 2, kRoundOff);
}

TEST(Meridian, DirectionIsTheDerivativeOfThePoint) {
  Mantle m = PaperMantle();
  m.pieces = {{0.03, 20.0}, {0.04, -15.0}, {0.02, 0.0}, {0.03, 1e-7}};
  constexpr double h = 1e-6;
  for (double x = 0.0013; x < 0.12; x += 0.0071) {
    const MeridianPoint a = MeridianAt(m, x - h), b = MeridianAt(m, x + h), p = MeridianAt(m, x);
    EXPECT_NEAR((b.r_m - a.r_m) / (2 * h), std::cos(p.theta_rad), 1e-9);
    EXPECT_NEAR((b.z_m - a.z_m) / (2 * h), std::sin(p.theta_rad), 1e-9);
  }
}

TEST(Meridian, NodesLieOnPieceEndsStripsAndStations) {
  for (int elements : {8, 32, 64, 101}) {
    for (double grading : {1.0, 4.0, 20.0, 0.2}) {
      const Mantle m = PaperMantle(elements, grading);
      const std::vector<double> x = MeridianNodes(m);
      ASSERT_EQ(static_cast<int>(x.size()), elements + 1);
      for (double at : {0.0, 0.025, 0.044, 0.105, 0.130}) {
        EXPECT_TRUE(
            std::any_of(x.begin(), x.end(), [&](double y) { return std::abs(y - at) < kRoundOff; }))
            << at << " with " << elements << " elements, grading " << grading;
      }
      for (std::size_t i = 1; i < x.size(); ++i) EXPECT_GT(x[i], x[i - 1]);
    }
  }
}

TEST(Meridian, GradingIsTheRatioOfLastToFirstElement) {
  Mantle m = PaperMantle(200, 5.0);
  m.stations_m.clear();
  m.pieces = {{0.130, 0.0}};
  const std::vector<double> x = MeridianNodes(m);
  const double ratio = (x[200] - x[199]) / (x[1] - x[0]);
  EXPECT_NEAR(ratio, 5.0, 0.05);  // lengths at midpoints of the end elements: 1/200 off
}

TEST(Meridian, TooFewElementsAreRefused) {
  EXPECT_NO_THROW(MeridianNodes(PaperMantle(4)));
  EXPECT_THROW(MeridianNodes(PaperMantle(3)), BadRobot);
}

}  // namespace
}  // namespace mantle::model
