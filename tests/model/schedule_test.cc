#include "model/schedule.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace mantle::model {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRoundOff = 1e-12;  // a dozen operations on numbers of order one

std::vector<Schedule> EveryKind() {
  return {ConstantSchedule{2.0}, TriangularSchedule{1.0, 5.0, 0.66, 0.1},
          SineSchedule{2.0, 1.5, 0.4, 0.3, 0.2}, IntervalSchedule{3.0, {0.1, 0.5}, {0.2, 0.9}},
          TableSchedule{{0.1, 0.4, 0.4, 0.8}, {1.0, 2.0, -1.0, 0.5}}};
}

TEST(Schedule, TriangularWaveIsThePapersPulse) {
  const Schedule pulse = TriangularSchedule{0.0, 325.0, 0.66, 0.0};
  EXPECT_EQ(Value(pulse, -1.0), 0.0);
  EXPECT_EQ(Value(pulse, 0.0), 0.0);
  EXPECT_NEAR(Value(pulse, 0.165), 162.5, 1e-9);
  EXPECT_NEAR(Value(pulse, 0.33), 325.0, 1e-9);
  EXPECT_NEAR(Value(pulse, 0.495), 162.5, 1e-9);
  EXPECT_NEAR(Value(pulse, 0.66), 0.0, 1e-9);
  EXPECT_NEAR(Value(pulse, 100 * 0.66 + 0.33), 325.0, 1e-9);
  EXPECT_NEAR(Rate(pulse, 0.1), 325.0 / 0.33, 1e-9);
  EXPECT_NEAR(Rate(pulse, 0.33, true), 325.0 / 0.33, 1e-9);
  EXPECT_NEAR(Rate(pulse, 0.33), -325.0 / 0.33, 1e-9);
  EXPECT_NEAR(Rate(pulse, 0.66, true), -325.0 / 0.33, 1e-9);
  EXPECT_NEAR(Rate(pulse, 0.66), 325.0 / 0.33, 1e-9);
  EXPECT_EQ(Rate(pulse, 0.0, true), 0.0);
  EXPECT_NEAR(NextBreakpoint(pulse, 0.0), 0.33, kRoundOff);
  EXPECT_NEAR(NextBreakpoint(pulse, 0.33), 0.66, kRoundOff);
}

TEST(Schedule, BreakPointsOfAWaveNeverRepeat) {
  const Schedule wave = TriangularSchedule{0.0, 1.0, 0.66, 0.0};
  double t = 0.0;
  for (int i = 1; i <= 10000; ++i) {
    const double next = NextBreakpoint(wave, t);
    ASSERT_NEAR(next - t, 0.33, 1e-9) << i;
    t = next;
  }
  EXPECT_NEAR(t, 3300.0, 1e-6);
}

TEST(Schedule, IntervalsSwitchOnAndOffWithBothLimits) {
  const Schedule s = IntervalSchedule{3.0, {0.1, 0.5}, {0.2, 0.9}};
  EXPECT_EQ(Value(s, 0.05), 0.0);
  EXPECT_EQ(Value(s, 0.1), 3.0);
  EXPECT_EQ(Value(s, 0.1, true), 0.0);
  EXPECT_EQ(Value(s, 0.2), 0.0);
  EXPECT_EQ(Value(s, 0.2, true), 3.0);
  EXPECT_EQ(Value(s, 0.7), 3.0);
  EXPECT_EQ(Value(s, 1.0), 0.0);
  std::vector<double> breaks;
  for (double t = -1.0; (t = NextBreakpoint(s, t)) < kInfinity;) breaks.push_back(t);
  EXPECT_EQ(breaks, (std::vector<double>{0.1, 0.2, 0.5, 0.9}));
}

TEST(Schedule, TablesInterpolateAndJump) {
  const Schedule s = TableSchedule{{0.1, 0.4, 0.4, 0.8}, {1.0, 2.0, -1.0, 0.5}};
  EXPECT_EQ(Value(s, 0.0), 1.0);
  EXPECT_NEAR(Value(s, 0.25), 1.5, kRoundOff);
  EXPECT_NEAR(Value(s, 0.4, true), 2.0, kRoundOff);
  EXPECT_NEAR(Value(s, 0.4), -1.0, kRoundOff);
  EXPECT_NEAR(Value(s, 0.6), -0.25, kRoundOff);
  EXPECT_EQ(Value(s, 2.0), 0.5);
  EXPECT_EQ(Rate(s, 2.0), 0.0);
}

TEST(Schedule, BreakPointsMissedByRoundOffCountAsReached) {
  const Schedule s = IntervalSchedule{3.0, {0.3}, {0.6}};
  const double t = 0.1 + 0.2;  // one bit above 0.3
  EXPECT_EQ(Value(s, t), 3.0);
  EXPECT_EQ(Value(s, t, true), 0.0);
  EXPECT_EQ(NextBreakpoint(s, t), 0.6);
  EXPECT_EQ(NextBreakpoint(s, std::nextafter(0.3, 0.0)), 0.6);
}

TEST(Schedule, RatesAreTheDerivativesOfValues) {
  constexpr double kStep = 1e-5;
  constexpr double kDifferences = 1e-7;  // truncation h^2 w^3, round-off 1e-16 / h
  for (const Schedule& s : EveryKind()) {
    for (double t = 0.0137; t < 2.0; t += 0.0731) {
      if (NextBreakpoint(s, t - 2 * kStep) < t + 2 * kStep) continue;
      EXPECT_NEAR(Rate(s, t), (Value(s, t + kStep) - Value(s, t - kStep)) / (2 * kStep),
                  kDifferences)
          << "kind " << s.index() << " t " << t;
      EXPECT_NEAR(SecondRate(s, t), (Rate(s, t + kStep) - Rate(s, t - kStep)) / (2 * kStep),
                  100 * kDifferences)
          << "kind " << s.index() << " t " << t;
      EXPECT_EQ(Value(s, t), Value(s, t, true));
    }
  }
}

TEST(Schedule, LimitsFromBothSidesAgreeWithNearbyValues) {
  constexpr double kNear_s = 1e-9;
  for (const Schedule& s : EveryKind()) {
    double t = -1.0;
    for (int i = 0; i < 6; ++i) {
      t = NextBreakpoint(s, t);
      if (t == kInfinity) break;
      EXPECT_NEAR(Value(s, t), Value(s, t + kNear_s), 1e-6) << s.index();
      EXPECT_NEAR(Value(s, t, true), Value(s, t - kNear_s), 1e-6) << s.index();
      EXPECT_NEAR(Rate(s, t), Rate(s, t + kNear_s), 1e-6) << s.index();
      EXPECT_NEAR(Rate(s, t, true), Rate(s, t - kNear_s), 1e-6) << s.index();
    }
  }
}

TEST(Schedule, OnlyConstantsAreConstant) {
  const auto kinds = EveryKind();
  for (std::size_t i = 0; i < kinds.size(); ++i) EXPECT_EQ(IsConstant(kinds[i]), i == 0);
  EXPECT_EQ(NextBreakpoint(kinds[0], 0.0), kInfinity);
}

}  // namespace
}  // namespace mantle::model
