#include "tools/report/packed_array.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace mantle::testing_tools {
namespace {

using namespace tools;

std::string Encoded(const std::string& text) {
  return Base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(PackedArray, Base64IsThatOfRfc4648) {
  EXPECT_EQ(Encoded(""), "");
  EXPECT_EQ(Encoded("f"), "Zg==");
  EXPECT_EQ(Encoded("fo"), "Zm8=");
  EXPECT_EQ(Encoded("foobar"), "Zm9vYmFy");
}

TEST(PackedArray, SixteenBitsLoseHalfAStepAtMostAndSayHowMuch) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw(-3.0, 7.0);
  std::vector<double> values(1000);
  for (double& v : values) v = draw(random);
  const PackedArray packed = Pack(values);
  EXPECT_EQ(packed.json["k"], "u16");
  const double step = packed.json["step"];
  EXPECT_GT(packed.error, 0.1 * step);
  EXPECT_LE(packed.error, 0.5001 * step);
  EXPECT_LT(step, 10.0 / 65'000);
}

TEST(PackedArray, WholeNumbersKeepTheirValue) {
  const PackedArray packed = Pack(std::vector<double>{0x0237, 0x0218, 0x1637, 0});
  EXPECT_EQ(packed.json["step"], 1.0);
  EXPECT_EQ(packed.error, 0.0);
}

TEST(PackedArray, AConstantIsOneNumberAndNothingIsNone) {
  EXPECT_EQ(Pack(std::vector<double>(50, 2.5)).json.dump(), R"({"k":"c","n":50,"v":2.5})");
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Pack(std::vector<double>(3, none)).json.dump(), R"({"k":"c","n":3,"v":null})");
  const PackedArray mixed = Pack(std::vector<double>{1.5, none, 1.5});
  EXPECT_EQ(mixed.json["k"], "u16") << "a gap in a constant stays a gap";
}

TEST(PackedArray, WhereSixteenBitsAreTooFewSinglePrecisionIsTaken) {
  const std::vector<double> values = {0.0, 1e-6, 1e3};
  const PackedArray packed = Pack(values, 1e-4);
  EXPECT_EQ(packed.json["k"], "f32");
  EXPECT_LE(packed.error, 1e-4);
}

TEST(Thinning, KeepsBothEndsAndAtMostWhatItMay) {
  for (const std::size_t rows : {1U, 2U, 3U, 10U, 999U, 4001U, 60'001U}) {
    for (const std::size_t most : {2U, 3U, 100U, 4000U}) {
      const auto kept = EveryKth(rows, ThinningFor(rows, most));
      EXPECT_EQ(kept.front(), 0U);
      EXPECT_EQ(kept.back(), rows - 1);
      EXPECT_LE(kept.size(), std::max<std::size_t>(most, 1)) << rows << " " << most;
    }
  }
  EXPECT_EQ(ThinningFor(4000, 4000), 1U);
  EXPECT_EQ(EveryKth(21, ThinningFor(21, 3)), (std::vector<std::size_t>{0, 10, 20}));
}

TEST(Thinning, ErrorIsTheLargestDistanceFromTheLine) {
  const std::vector<double> time = {0, 1, 2, 3, 4}, kink = {0, 1, 5, 3, 4}, line = {0, 2, 4, 6, 8};
  const std::vector<std::size_t> ends = {0, 4};
  EXPECT_DOUBLE_EQ(ThinningError(time, kink, ends), 3.0);
  EXPECT_DOUBLE_EQ(ThinningError(time, line, ends), 0.0);
  EXPECT_DOUBLE_EQ(ThinningError(time, kink, std::vector<std::size_t>{0, 2, 4}), 1.5);
}

}  // namespace
}  // namespace mantle::testing_tools
