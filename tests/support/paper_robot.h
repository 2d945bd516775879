#pragma once

#include <cmath>
#include <numbers>

#include "model/robot.h"

/// The paper's robot (Tables 1 and 2 of [Renda], [physics.md] 1), without any effect switched on.

namespace mantle::tests {

inline constexpr double kMantleRadius = 0.031;
inline constexpr double kApexAngle = std::numbers::pi / 2 - 0.044 / kMantleRadius;  // the hole

inline model::Arm PaperArm(int elements = 20) {
  model::Arm arm;
  arm.name = "arm";
  // x = -e3, y = -e1, z = +e2, at the bottom of the cone
  model::Matrix3 r;
  r << 0, -1, 0, 0, 0, 1, -1, 0, 0;
  arm.mount.rotation = Eigen::Quaterniond(r);
  arm.mount.position = {0, 0, -0.112};
  arm.length_m = 0.42;
  arm.radius_base_m = 0.015;
  arm.radius_tip_m = 0.006;
  arm.material = {110e3, 0.0, 300.0, 1022.0};
  arm.drag_coefficients = {0.01, 2.5, 2.5};
  arm.added_mass_coefficient = 1.5;
  arm.elements = elements;
  return arm;
}

inline model::Mantle PaperMantle(int elements = 64, double grading = 1) {
  model::Mantle m;
  m.name = "mantle";
  m.r0_m = kMantleRadius * std::sin(kApexAngle);
  m.theta0_rad = -kApexAngle;
  m.pieces = {{0.044, -1.0 / kMantleRadius}, {0.086, 0.0}};
  m.half_thickness_m = 1e-3;
  m.material = {40e3, 0.0, 500.0, 1022.0};
  m.elements = elements;
  m.grading = grading;
  m.stations_m = {0.025, 0.105};
  m.nozzle_radius_m = 0.01;
  m.added_mass_coefficient = 1.1;
  m.drag_coefficient = 1.7;
  return m;
}

inline model::RigidBody PaperCone() { return {"cone", model::Cone{0.015, 0.112, 1022.0}}; }

inline model::Robot PaperRobot(int arm_elements = 20, int mantle_elements = 64) {
  model::Robot robot;
  robot.name = "robot";
  robot.arms = {PaperArm(arm_elements)};
  robot.mantle = PaperMantle(mantle_elements);
  robot.rigid_body = PaperCone();
  robot.body_length_m = 0.532;
  return robot;
}

/// Every effect of the paper and beyond it.
inline model::Effects EveryEffect() {
  model::Effects e;
  e.weight = e.buoyancy = e.drag = e.added_mass = e.viscosity = true;
  e.contained_water = e.lateral_added_mass = true;
  e.jet_thrust = model::JetThrust{};
  e.lateral_drag = model::LateralDrag{};
  e.named.Set(model::RollDrag{});
  e.named.Set(model::RigidDrag{});
  return e;
}

}  // namespace mantle::tests
