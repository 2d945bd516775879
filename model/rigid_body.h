#pragma once

#include "model/robot.h"

namespace mantle::model {

/// Screw inertia (6x6) about the root origin, [angular, linear]. Cone with its apex at the origin
/// and its axis along -e3: M_ri of [Renda] 3.3 with the centre of mass at -3/4 L_r ([physics.md]
/// 4).
Matrix6 RigidInertia(const RigidBody& body);
double RigidVolume(const RigidBody& body);
double RigidMass(const RigidBody& body);
/// Centre of mass, which is also taken as the centre of buoyancy.
Vector3 RigidCentre(const RigidBody& body);

/// Projected areas seen laterally and along e3, and the height [m] at which the drag acts: for a
/// cone h L, pi h^2 and the centroid -2/3 L of the lateral projection.
struct RigidDragGeometry {
  double lateral_area_m2, axial_area_m2, height_m;
};
RigidDragGeometry DragGeometry(const RigidBody& body, const RigidDrag& drag);

}  // namespace mantle::model
