#pragma once

#include <cmath>

#include "tests/controller/control_scene.h"

/// A truth that estimators may find: the reduced model under tensions that vary.

namespace mantle::tests {

inline constexpr double kPeriod_s = 0.01;

/// Of every sensor.
inline controller::SensorOptions Noise() {
  controller::SensorOptions noise;
  noise.position_m = 2e-3;
  noise.attitude_rad = 5e-3;
  noise.velocity_m_s = 5e-3;
  noise.angular_velocity_rad_s = 2e-2;
  noise.strain = 0.1;
  noise.strain_rate = 0.2;
  noise.mantle = noise.mantle_rate = 0.02;
  return noise;
}

/// The reduced model itself as the truth, pulled by tensions that vary.
struct Truth {
  explicit Truth(const std::string& scene)
      : world(scene), state(world.Start(0.0)), next(state), u(world.model.input_count()) {}

  /// One period; u are the tensions pulled during it, plus `bias` that nobody is told of.
  void Advance(const model::VectorX& bias, double h = kPeriod_s) {
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      u(i) = 0.2 + 0.1 * std::sin(3 * state.time_s + static_cast<double>(i));
    }
    EXPECT_TRUE(world.propagator.Step(state, h, u + bias, &next, nullptr).ok);
    next.time_s = state.time_s + h;
    std::swap(state, next);
  }
  model::VectorX NoBias() const { return model::VectorX::Zero(u.size()); }

  ControlScene world;
  reduced::ReducedState state, next;
  model::VectorX u;
};

}  // namespace mantle::tests
