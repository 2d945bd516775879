#include "model/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace mantle::model {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRoundOff = 1e-12;  // a dozen operations on numbers of order one

std::vector<Schedule> EveryKind() {
  return {ConstantSchedule{2.0},
          TriangularSchedule{1.0, 5.0, 0.66, 0.1},
          SineSchedule{2.0, 1.5, 0.4, 0.3, 0.2},
          IntervalSchedule{3.0, {0.1, 0.5}, {0.2, 0.9}},
          TableSchedule{{0.1, 0.4, 0.4, 0.8}, {1.0, 2.0, -1.0, 0.5}},
          CubicSchedule{{0.1, 0.4, 0.55, 0.8, 1.1}, {1.0, 2.0, 2.5, -1.0, -1.0}},
          PulseSchedule{-1.0, 2.0, 0.7, 0.2, 0.1, 0.3, 0.15, true},
          PulseSchedule{0.5, 3.0, 0.6, 0.2, 0.1, 0.0, -0.2, false},
          PulseSchedule{0.5, 3.0, 0.6, 0.0, 0.3, 0.3, 0.1, true}};
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

TEST(Schedule, CubicsPassThroughTheirValuesAndNeverBeyond) {
  const CubicSchedule cubic{{0.1, 0.4, 0.55, 0.8, 1.1}, {1.0, 2.0, 2.5, -1.0, -1.0}};
  const Schedule s = cubic;
  for (std::size_t i = 0; i < cubic.time_s.size(); ++i) {
    EXPECT_NEAR(Value(s, cubic.time_s[i]), cubic.value[i], kRoundOff);
    EXPECT_NEAR(Rate(s, cubic.time_s[i]), Rate(s, cubic.time_s[i], true), kRoundOff) << i;
  }
  EXPECT_EQ(Rate(s, 0.1), 0.0);   // from rest ...
  EXPECT_EQ(Rate(s, 0.55), 0.0);  // ... at a turn ...
  EXPECT_EQ(Rate(s, 1.1), 0.0);   // ... to rest
  EXPECT_GT(Rate(s, 0.4), 1.0);   // and through a point between
  for (std::size_t i = 0; i + 1 < cubic.time_s.size(); ++i) {
    const double low = std::min(cubic.value[i], cubic.value[i + 1]);
    const double high = std::max(cubic.value[i], cubic.value[i + 1]);
    for (double u = 0; u <= 1; u += 0.01) {
      const double v = Value(s, cubic.time_s[i] + u * (cubic.time_s[i + 1] - cubic.time_s[i]));
      EXPECT_GE(v, low - kRoundOff);
      EXPECT_LE(v, high + kRoundOff);
    }
  }
  EXPECT_EQ(Value(s, 0.0), 1.0);
  EXPECT_EQ(Value(s, 2.0), -1.0);
  EXPECT_FALSE(FirstJump(s));
}

TEST(Schedule, PulsesRiseHoldFallAndRepeat) {
  const Schedule s = PulseSchedule{-1.0, 2.0, 0.7, 0.2, 0.1, 0.3, 0.15, true};
  for (int n : {0, 1, 57}) {
    const double from = 0.15 + 0.7 * n;
    EXPECT_NEAR(Value(s, from), -1.0, 1e-9);
    EXPECT_NEAR(Value(s, from + 0.1), 0.5, 1e-9);
    EXPECT_NEAR(Value(s, from + 0.25), 2.0, 1e-9);
    EXPECT_NEAR(Value(s, from + 0.45), 0.5, 1e-9);
    EXPECT_NEAR(Value(s, from + 0.65), -1.0, 1e-9);
    double t = from;
    for (double edge : {0.2, 0.3, 0.6, 0.7}) {
      t = NextBreakpoint(s, t);
      EXPECT_NEAR(t, from + edge, 1e-9);
    }
  }
  EXPECT_EQ(Value(s, -3.0), -1.0);
  EXPECT_EQ(NextBreakpoint(s, -3.0), 0.15);
  EXPECT_FALSE(FirstJump(s));
  const Schedule square = PulseSchedule{0.0, 1.0, 1.0, 0.0, 0.25, 0.0, 0.5, true};
  EXPECT_EQ(Value(square, 0.5, true), 0.0);
  EXPECT_EQ(Value(square, 0.5), 1.0);
  EXPECT_EQ(Value(square, 0.75, true), 1.0);
  EXPECT_EQ(Value(square, 0.75), 0.0);
  ASSERT_TRUE(FirstJump(square));
  EXPECT_EQ(FirstJump(square)->time_s, 0.5);
  EXPECT_EQ(FirstJump(square)->size, 1.0);
  const Schedule back_to_back = PulseSchedule{0.0, 1.0, 0.5, 0.2, 0.1, 0.2, 0.0, false};
  double t = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double next = NextBreakpoint(back_to_back, t);
    ASSERT_GT(next, t + 0.05) << i;
    ASSERT_LT(next, t + 0.25) << i;
    t = next;
  }
}

TEST(Schedule, IntegralsAreThoseOfTheValues) {
  constexpr double kQuadrature = 1e-9;  // Simpson on pieces between break points, h^4
  const auto simpson = [](const Schedule& s, double from, double to) {
    constexpr int n = 1024;
    const double h = (to - from) / n;
    double sum = Value(s, from) + Value(s, to, true);
    for (int i = 1; i < n; ++i) sum += (i % 2 != 0 ? 4.0 : 2.0) * Value(s, from + i * h);
    return sum * h / 3.0;
  };
  for (const Schedule& s : EveryKind()) {
    for (const double end : {0.17, 0.6, 2.3, -0.35}) {
      double sum = 0, t = std::min(end, 0.0);
      const double last = std::max(end, 0.0);
      while (t < last) {
        const double next = std::min(NextBreakpoint(s, t), last);
        sum += simpson(s, t, next);
        t = next;
      }
      EXPECT_NEAR(Integral(s, end), end < 0 ? -sum : sum, kQuadrature)
          << "kind " << s.index() << " end " << end;
    }
    EXPECT_EQ(Integral(s, 0.0), 0.0);
  }
}

TEST(Schedule, OnlyConstantsAreConstant) {
  const auto kinds = EveryKind();
  for (std::size_t i = 0; i < kinds.size(); ++i) EXPECT_EQ(IsConstant(kinds[i]), i == 0);
  EXPECT_EQ(NextBreakpoint(kinds[0], 0.0), kInfinity);
}

}  // namespace
}  // namespace mantle::model
