#include "model/failure.h"

#include <fmt/format.h>

namespace mantle::model {

ValueAndBound PrintBeyond(double value, double bound) {
  ValueAndBound text;
  for (int digits = 6; digits <= 17 && text.value == text.bound; ++digits) {
    text.value = fmt::format("{:.{}g}", value, digits);
    text.bound = fmt::format("{:.{}g}", bound, digits);
  }
  return text;
}

std::string EvaluationFailure::Message() const {
  const std::string place = node < 0 ? body : fmt::format("{}: {} {}", body, part, node);
  const ValueAndBound text = PrintBeyond(value, bound);
  return fmt::format("{}: {}: {}, bound {}{}{}", place, cause, text.value, text.bound,
                     advice == nullptr ? "" : "; ", advice == nullptr ? "" : advice);
}

}  // namespace mantle::model
