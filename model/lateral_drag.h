#pragma once

#include "model/lie.h"

namespace mantle::model {

/// A slice of lateral drag at height z on the root's axis, -k |u| u with u the axis' lateral
/// velocity there, as a wrench about the origin; and the derivatives of that wrench in the twist,
/// in z and in k. The wrench and each derivative are added to.
void AddLateralDragSlice(double k, double z_m, const Vector6& root_twist, Vector6* wrench);
void AddLateralDragSliceTangent(double k, double z_m, const Vector6& root_twist, Matrix6* by_twist,
                                Vector6* by_z, Vector6* by_k);

}  // namespace mantle::model
