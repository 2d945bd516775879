#pragma once

#include "reduced/arm.h"
#include "reduced/tangent_jet.h"

/// Inverse dynamics of a reduced arm and its exact derivatives, by recursion along the chain.
///
/// All quantities are expressed in the root frame, at the root's origin, as seen from an inertial
/// frame that coincides with it at this instant. With S_k = Ad_{h_k} T_k E_k the columns of
/// interval k (h_k its end's pose relative to the root, T_k the tangent operator, E_k =
/// dOmega_k/dq):
///   V_k = V_{k-1} + S_k q_dot,   A_k = A_{k-1} + S'_k q_dot + S_k q_ddot,   ' = inertial rate
///   w_k = I_k A_k - ad_{V_k}^T I_k V_k - loads_k,     R_q = sum_k S_k^T W_k,  W_k = sum_{l>=k} w_l
/// Column i of a change of coordinates changes V by S'_i and A by S''_i - ad_V S'_i, of a change of
/// rates by S_i and 2 S'_i - ad_V S_i, and the wrenches' own motion by -N(w) S_i; summed from the
/// tip, this gives M, D = dR/dq_dot and K = dR/dq with one set of composite 6x6 matrices
/// (composite rigid-body algorithm; Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 6;
/// Carpentier & Mansard, Analytical derivatives, RSS 2018).

namespace mantle::reduced {

/// More columns do not fit on the stack of the linearisation: six strains of degree 12.
inline constexpr int kMostColumns = 6 * 13;

/// What the arm's evaluation reads: pointers into the model's state and inputs.
struct ArmMotion {
  const double *q, *q_dot, *q_ddot;
  Vector6 root_twist, root_acceleration;
  Eigen::Quaterniond root_rotation;
  double gravity_scale;
  const model::CableInput* cables;
  const double *distributed, *points;
  const model::MuscleInput* muscles{nullptr};
  const double* envelopes{nullptr};
  const double* payloads{nullptr};
  Vector3 water_acceleration_m_s2{Vector3::Zero()};
};

struct IntervalState {
  Vector6 omega, omega_dot, omega_ddot;
  TangentJet jet;
  TangentCoefficients coefficients;
  Matrix3 rotation;  ///< of h_k
  Vector3 position;
  Vector6 twist, acceleration;  ///< V_k, A_k
  Vector6 own_wrench;           ///< w_k
  Vector6 internal;  ///< of it, loads whose reaction the root carries (model::IsInternal)
  Vector6 wrench, body_wrench;          ///< W_k, and in the frame of the interval's end
  Vector6 stress;                       ///< T_k^T body_wrench, conjugate to Omega_k
  Columns columns, columns1, columns2;  ///< S, S', S''
};

/// Of the intervals of one group, during the linearisation.
struct GroupSums {
  explicit GroupSums(int count);
  void SetZero();

  Columns columns, columns1, columns2;  ///< sums of S, S', S''
  /// Sums of the change of the wrench on the root by accelerations, rates and coordinates, and of
  /// the coordinates' wrenches by the root's rates and increments.
  Columns mass, damping, stiffness, rate, rotation;
};

struct ArmWork {
  explicit ArmWork(const ReducedArm& arm);

  std::vector<IntervalState> at;
  Vector6 base_wrench;  ///< of the base section, and (after the call) the total on the root
  VectorX residual;     ///< R_q
  bool has_internal{false};
  std::vector<double> cable_length_m, cable_rate_m_s, cable_tension_n;
  std::vector<VectorX> cable_gradient;  ///< dl/dq
  std::vector<GroupSums> groups;
};

/// Poses of the interval ends relative to the root, without dynamics; for lifting and outputs.
void EvaluateArmPoses(const ReducedArm& arm, const double* q, std::vector<Pose>* poses);

/// Length, rate and gradient of one cable. EvaluateArm does this for cables that are pulled or
/// reeled; slack ones are evaluated where they are asked for.
void EvaluateCable(const ReducedArm& arm, const ArmMotion& motion, int cable, ArmWork* work);

/// Fills `work`; false where something is not finite.
bool EvaluateArm(const ReducedArm& arm, const ArmMotion& motion, ArmWork* work);

/// Blocks of the whole robot's matrices: rows and columns 0..5 belong to the root, `first` is the
/// row of the arm's first coordinate. All are added to.
struct Linearisation {
  Eigen::MatrixXd mass, damping, stiffness;  ///< M, dR/dv, dR/d(increment)
};
void LineariseArm(const ReducedArm& arm, const ArmMotion& motion, int first, ArmWork* work,
                  Linearisation* out);

/// Adds gain dR/d(input) for one distributed amplitude or point wrench; cables are made from
/// cable_gradient.
void AddDistributedColumn(const ReducedArm& arm, const ArmMotion& motion, const ArmWork& work,
                          int load, double gain, int first, Eigen::Ref<VectorX> column);
void AddPointColumn(const ReducedArm& arm, const ArmMotion& motion, const ArmWork& work, int point,
                    double gain, int first, Eigen::Ref<VectorX> column);

}  // namespace mantle::reduced
