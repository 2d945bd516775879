#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "model/schema.h"

/// @file
/// Quantities as people write them: a plain number is SI, a text is number and unit ("15 mm",
/// "110 kPa", "45 deg"), and the unit has to be one of the quantity's own.

namespace mantle::scene {

using schema::Quantity;

/// "m", "Pa s"; empty for a plain number.
std::string_view SiUnit(Quantity quantity);

/// Every unit that is accepted, "m, mm, cm"; empty for a plain number.
std::string UnitsOf(Quantity quantity);

/// "> 0", "in [0, 1]", "in (0, 0.1]"; empty for any value.
std::string BoundText(schema::Range range);

/// The value in SI, or nothing where the text is not number + unit of the quantity. A number
/// without a unit is not a text's business: the SI number is written without quotes.
std::optional<double> ParseQuantity(std::string_view text, Quantity quantity);

}  // namespace mantle::scene
