#include "loop/timing.h"

#include <gtest/gtest.h>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {
namespace {

TEST(DurationHistogram, QuantilesLieWithinABinAboveTheValues) {
  DurationHistogram histogram;
  for (std::int64_t us = 1; us <= 1000; ++us) histogram.Add(us);
  EXPECT_EQ(histogram.count(), 1000U);
  EXPECT_EQ(histogram.worst_us(), 1000);
  constexpr double kBin = 1.19;  // 2^(1/4)
  for (const double share : {0.1, 0.5, 0.99}) {
    EXPECT_GE(histogram.Quantile_us(share), 1000 * share);
    EXPECT_LE(histogram.Quantile_us(share), 1000 * share * kBin);
  }
  EXPECT_EQ(histogram.Quantile_us(1.0), 1000.0);
}

TEST(DurationHistogram, BinsHoldWhatLiesBetweenTheirBegins) {
  for (const std::int64_t us : {0, 1, 2, 3, 16, 1000, 1 << 20, 5'000'000}) {
    DurationHistogram histogram;
    histogram.Add(us);
    std::size_t bin = 0;
    while (histogram.bins()[bin] == 0) ++bin;
    EXPECT_LE(DurationHistogram::BinBegin_us(bin), static_cast<double>(us) + 1e-6);
    if (bin + 1 < DurationHistogram::kBins) {
      EXPECT_GT(DurationHistogram::BinBegin_us(bin + 1), static_cast<double>(us));
    }
  }
  EXPECT_EQ(DurationHistogram().Quantile_us(0.5), 0.0) << "of nothing";
}

TEST(BareTimer, WakesEveryPeriodAndNeverEarly) {
  BareTimer timer(2'000);
  firmware_sim::SleepFor(100'000);
  timer.Stop();
  EXPECT_GT(timer.lateness().count(), 10U);
  EXPECT_LE(timer.lateness().count(), 51U);
  EXPECT_GE(timer.lateness().worst_us(), 0);
}

}  // namespace
}  // namespace mantle::loop
