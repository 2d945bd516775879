#pragma once

#include <vector>

#include "model/inputs.h"
#include "model/loads.h"
#include "model/rod.h"
#include "reduced/strain_basis.h"

/// An arm reduced to strain coordinates: a chain of intervals of exponential kinematics between
/// sections, where the loads and inertia of model/loads.h and model/rod.h are taken.
///
///   g_k = g_{k-1} exp(Omega_k),  Omega_k = h xi (constant strain, exact), or Magnus' fourth order
///   Omega_k = h/2 (xi_1 + xi_2) + (sqrt(3)/12) h^2 [xi_1, xi_2] at two Gauss points;
///   K_q = int B^T Sigma B dX,  D_q = int B^T Upsilon B dX  (constant: the material is linear).

namespace mantle::reduced {

using model::Matrix6;
using model::Pose;
using model::Vector3;
using model::Vector6;
using model::VectorX;

/// Columns of a group, by rows: the coordinates are the inner loop.
using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>;

struct Interval {
  int group{0};
  int section{-1};  ///< at its end, or -1
  double length_m{0}, end_m{0};
  Vector6 reference{Vector6::Zero()};  ///< Omega at rest (constant strain only)
  Columns basis;                       ///< dOmega/dq of the group (its constant part)
  bool magnus{false};
  Columns basis1, basis2;                                  ///< B at the two Gauss points
  Vector6 rest1{Vector6::Zero()}, rest2{Vector6::Zero()};  ///< xi* there
  double kappa{0};                                         ///< sqrt(3)/12 h^2
};

struct CablePoint {
  int group;
  model::CablePiece piece;
  model::RodElement element;  ///< only its length, the quadrature weight, is used
  Vector6 reference;          ///< weight xi*
  Columns basis;              ///< weight B
};

struct ReducedCable {
  std::vector<CablePoint> points;
  double length_offset_m{0};  ///< plant's rest length minus this quadrature's
  /// Integrals over the cable of its offset (base frame of the arm) and of the offset's norm [m^2].
  Vector3 offset_integral_m2{Vector3::Zero()};
  double distance_integral_m2{0};
};

/// A place where muscles act: their generalised force is basis^T m.
struct MusclePoint {
  int group;
  double x_m;
  Columns basis;  ///< weight B
};

struct ReducedPayload {
  int interval;  ///< at its end; -1: the base
  Matrix6 inertia;
  std::vector<model::RootLoad> loads;
};

struct ReducedPoint {
  int interval;  ///< whose end carries it; -1: the base
  model::PointWrench load;
};

struct ReducedArm {
  ArmReduction reduction;
  StrainBasis basis;
  Pose mount;
  std::vector<Interval> intervals{};
  int dynamic_intervals{
      0};  ///< up to the last section or point load; the rest only reaches the tip
  std::vector<model::RodNode> sections{};
  int base_section{-1};  ///< at X = 0, fixed to the root (plant's nodes only)
  std::vector<model::SectionLoad> loads{};
  std::vector<model::DistributedLoad> distributed{};
  std::vector<ReducedPoint> points{};
  std::vector<ReducedCable> cables{};
  std::vector<model::MuscleWave> muscles{};
  std::vector<MusclePoint> muscle_points{};
  std::vector<ReducedPayload> payloads{};
  bool needs_rotation{false};  ///< some load depends on the orientation in the world
  Eigen::MatrixXd stiffness{}, damping{};
  bool viscous{false};

  int size() const { return basis.size(); }
};

}  // namespace mantle::reduced
