#pragma once

#include "reduced/arm_dynamics.h"

namespace mantle::reduced {

/// Composite matrices of all sections beyond an interval, in the root frame: coefficients of S''
/// (and of S' in D), of S' (and of S in D), and of S in the change of the wrench W they carry:
///   I,   -N(I V) - ad_V^T I - I ad_V - d loads/d twist,   -d loads/d rotation.
struct Composite {
  Matrix6 inertia{Matrix6::Zero()}, rate{Matrix6::Zero()}, rotation{Matrix6::Zero()};
};

/// Adds a section at (rotation r, position p) that moves with `twist`.
void AddSection(const ReducedArm& arm, const ArmMotion& m, const model::RodNode& node,
                const Matrix3& r, const Vector3& p, const Vector6& twist, Composite* out);
/// Adds a payload, `attached` of it.
void AddPayload(const ReducedArm& arm, const ArmMotion& m, const ReducedPayload& payload,
                double attached, const Matrix3& r, const Vector3& p, const Vector6& twist,
                Composite* out);
/// Adds to the rotation part of a section's distributed loads those alone whose reaction the root
/// carries.
void AddInternalRotation(const ReducedArm& arm, const ArmMotion& m, const model::RodNode& node,
                         const Matrix3& r, const Vector3& p, Matrix6* rotation);
/// Adds a wrench at a point.
void AddPoint(const ArmMotion& m, const ReducedPoint& point, double amplitude, const Matrix3& r,
              const Vector3& p, Composite* out);

}  // namespace mantle::reduced
