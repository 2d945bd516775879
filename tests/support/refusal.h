#pragma once

#include <exception>
#include <string>

namespace mantle::tests {

/// What a call throws, in words; "not refused" where it throws nothing.
template <typename Call>
std::string Refusal(Call call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "not refused";
}

}  // namespace mantle::tests
