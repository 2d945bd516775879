#pragma once

#include <string>
#include <vector>

#include "model/plant.h"

namespace mantle::python {

/// A robot's whole bodies at one instant, in the earth's frame and with the units of docs/scene.md:
/// nodes' poses and twists, strains, stress resultants. Each quantity keeps its storage, a column
/// for each node or element, so that arrays may look at it.
///
///   strain xi = log(g1^-1 g2) / l,  stress sigma = Sigma (xi - xi*) + Upsilon xi_dot (model/
///   rod_element.h), without cables, muscles and coupled strains
struct BodyShape {
  using Rows3 = Eigen::Matrix3Xd;
  using Rows4 = Eigen::Matrix4Xd;
  using Rows6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  /// An arm: N elements between N + 1 nodes, from the base.
  struct Arm {
    std::string name;
    Eigen::VectorXd arc_length_m;
    Rows3 position_m;
    Rows4 quaternion_wxyz;
    Rows6 twist;           ///< section frame [rad/s, m/s]
    Rows6 strain, stress;  ///< of elements [1/m, 1; N m, N]
  };
  /// The mantle's meridian, relative to the root.
  struct Mantle {
    std::string name;
    Eigen::VectorXd arc_length_m;
    Rows3 profile, profile_rate;                      ///< (r, z, theta) [m, m, rad] and their rates
    Eigen::Matrix<double, 5, Eigen::Dynamic> strain;  ///< of elements, model/shell_element.h
  };

  explicit BodyShape(const model::Plant& plant);
  /// Of a state of the same plant; poses and twists get the current's drift and velocity.
  void Set(const model::Plant& plant, const model::PlantState& state);

  double time_s{0};
  Eigen::Vector3d root_position_m;
  Eigen::Vector4d root_quaternion_wxyz;
  model::Vector6 root_twist;
  std::vector<Arm> arms;
  std::vector<Mantle> mantle;  ///< none or one
};

}  // namespace mantle::python
