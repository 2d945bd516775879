#pragma once

#include <random>

#include "model/lie.h"

/// Random vectors and poses with fixed seeds.

namespace mantle::tests {

class RandomValues {
 public:
  explicit RandomValues(unsigned seed) : engine_(seed) {}

  /// Uniform in [-1, 1].
  double Uniform() { return std::uniform_real_distribution<double>(-1.0, 1.0)(engine_); }
  double Between(double low, double high) { return low + 0.5 * (Uniform() + 1.0) * (high - low); }
  model::Vector3 Cube() { return {Uniform(), Uniform(), Uniform()}; }
  model::Vector3 Direction() {
    for (;;) {
      const model::Vector3 v = Cube();
      const double n = v.norm();
      if (n > 0.1 && n <= 1.0) return v / n;
    }
  }
  model::Vector6 Twist(double angular, double linear) {
    model::Vector6 d;
    d << angular * Cube(), linear * Cube();
    return d;
  }
  model::Pose AnyPose(double distance) {
    return {model::ExpSO3(Between(0.0, 3.0) * Direction()), distance * Cube()};
  }

 private:
  std::mt19937 engine_;
};

}  // namespace mantle::tests
