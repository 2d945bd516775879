#pragma once

#include <vector>

#include "model/lie.h"

/// @file
/// Where the root has been, for mean velocities over a pulse.

namespace mantle::controller {

using model::Vector3;

/// Its places over the last `length_s`.
class PositionHistory {
 public:
  explicit PositionHistory(double length_s) : length_s_(length_s) {}
  void Reset(double t_s, const Vector3& position);
  void Add(double t_s, const Vector3& position);
  /// Linear between entries; the first one before them all.
  Vector3 At(double t_s) const;

 private:
  struct Entry {
    double time_s;
    Vector3 position;
  };
  double length_s_;
  std::vector<Entry> entries_;
};

}  // namespace mantle::controller
