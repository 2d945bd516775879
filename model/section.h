#pragma once

#include "model/bodies.h"
#include "model/power_names.h"

/// @file
/// What loads on a section of an arm, and on the root, read and give.

namespace mantle::model {

/// Geometry of a section, or its mean over the neighbourhood of a node.
struct SectionGeometry {
  double x_m{0};  ///< arc length
  double area_m2{0};
  double radius_m{0};
  double density_kg_m3{0};              ///< mass over displaced volume
  Vector3 drag_shape{Vector3::Ones()};  ///< half widths that drag sees along x, y, z, over radius
};

/// Motion of a section, or of the root for loads on it.
struct SectionMotion {
  Eigen::Quaterniond rotation;                       ///< section to world
  Vector6 twist;                                     ///< relative to the water, section frame
  Vector3 water_acceleration_m_s2{Vector3::Zero()};  ///< world frame
};

/// Derivatives of a wrench density in the body increment zeta (rotation part only) and the twist.
struct LoadTangent {
  Matrix3 force_by_rotation{Matrix3::Zero()};   ///< [N/m per rad]
  Matrix3 moment_by_rotation{Matrix3::Zero()};  ///< [N per rad]
  Matrix3 force_by_velocity{Matrix3::Zero()};   ///< [N s/m^2]
};

/// Derivatives of a wrench in the root's body increment (rotation part only) and in its twist.
struct RootTangent {
  Eigen::Matrix<double, 6, 3> by_rotation{Eigen::Matrix<double, 6, 3>::Zero()};  ///< per rad
  Matrix6 by_twist{Matrix6::Zero()};  ///< per rad/s, per m/s
};

}  // namespace mantle::model
