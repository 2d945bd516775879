#include "loop/scene/units.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mantle::scene {
namespace {

TEST(Units, PrefixesScaleToSi) {
  EXPECT_DOUBLE_EQ(*ParseQuantity("15 mm", Quantity::kLength), 0.015);
  EXPECT_DOUBLE_EQ(*ParseQuantity("15mm", Quantity::kLength), 0.015);
  EXPECT_DOUBLE_EQ(*ParseQuantity("-1.5e2 cm", Quantity::kLength), -1.5);
  EXPECT_DOUBLE_EQ(*ParseQuantity("110 kPa", Quantity::kPressure), 110e3);
  EXPECT_DOUBLE_EQ(*ParseQuantity("45 deg", Quantity::kAngle), std::numbers::pi / 4);
  EXPECT_DOUBLE_EQ(*ParseQuantity("1.022 g/cm^3", Quantity::kDensity), 1022);
  EXPECT_DOUBLE_EQ(*ParseQuantity("296 mL", Quantity::kVolume), 296e-6);
}

TEST(Units, UnitsOfOtherQuantitiesAreRefused) {
  EXPECT_FALSE(ParseQuantity("15 mm", Quantity::kTime));
  EXPECT_FALSE(ParseQuantity("15 Pa", Quantity::kLength));
  EXPECT_FALSE(ParseQuantity("15 lb", Quantity::kMass));
  EXPECT_FALSE(ParseQuantity("15", Quantity::kLength)) << "a text without a unit says nothing";
  EXPECT_FALSE(ParseQuantity("mm", Quantity::kLength));
  EXPECT_FALSE(ParseQuantity("", Quantity::kLength));
  EXPECT_FALSE(ParseQuantity("15 mm 3", Quantity::kLength));
  EXPECT_FALSE(ParseQuantity("1 m", Quantity::kNumber));
}

TEST(Units, TheFirstUnitIsSi) {
  for (int i = 1; i <= static_cast<int>(Quantity::kRollDrag); ++i) {
    const auto quantity = static_cast<Quantity>(i);
    ASSERT_FALSE(SiUnit(quantity).empty()) << i;
    EXPECT_EQ(UnitsOf(quantity).rfind(SiUnit(quantity), 0), 0u) << i;
    EXPECT_DOUBLE_EQ(ParseQuantity("2 " + std::string(SiUnit(quantity)), quantity).value_or(-1),
                     2.0)
        << SiUnit(quantity);
  }
}

}  // namespace
}  // namespace mantle::scene
