#pragma once

#include <optional>
#include <string>
#include <string_view>

/// Quantities as people write them: a plain number is SI, a text is number and unit ("15 mm",
/// "110 kPa", "45 deg"), and the unit has to be one of the quantity's own.

namespace mantle::scene {

/// What a number means. The name of a quantity's SI unit is SiUnit().
enum class Quantity {
  kNumber,
  kLength,
  kTime,
  kMass,
  kAngle,
  kForce,
  kMoment,
  kForcePerLength,
  kMomentPerLength,
  kPressure,
  kViscosity,
  kDensity,
  kSpeed,
  kAngularSpeed,
  kAcceleration,
  kFrequency,
  kCurvature,
  kStiffness,
  kDamping,
  kArea,
  kVolume,
  kInertia,
  kRollDrag,
  kSectionStiffness,  ///< diagonal of N m^2 (first three) and N (last three)
  kSectionDamping,    ///< N m^2 s and N s
  kSectionInertia     ///< kg m and kg/m
};

/// "m", "Pa s"; empty for a plain number.
std::string_view SiUnit(Quantity quantity);

/// Every unit that is accepted, "m, mm, cm"; empty for a plain number.
std::string UnitsOf(Quantity quantity);

/// The value in SI, or nothing where the text is not number + unit of the quantity. A number
/// without a unit is not a text's business: the SI number is written without quotes.
std::optional<double> ParseQuantity(std::string_view text, Quantity quantity);

}  // namespace mantle::scene
