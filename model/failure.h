#pragma once

#include <string>

/// Why a state could not be evaluated, as plain values: for plant and reduced model alike.

namespace mantle::model {

/// A value and the bound it is beyond as text, with the digits it takes to tell them apart (six, or
/// as many as differ): a value just beyond 2.8 must not read as 2.8.
struct ValueAndBound {
  std::string value, bound;
};
ValueAndBound PrintBeyond(double value, double bound);

/// Body, node or element, cause, value and bound, and what to do about it. All text has static
/// life, or the model's.
struct EvaluationFailure {
  const char* body{nullptr};
  int node{-1};
  const char* cause{nullptr};
  double value{0}, bound{0};
  const char* part{"node"};  ///< what `node` counts
  const char* advice{nullptr};

  explicit operator bool() const { return cause != nullptr; }
  std::string Message() const;
};

}  // namespace mantle::model
