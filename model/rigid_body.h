#pragma once

#include "model/bodies.h"

namespace mantle::model {

/// Screw inertia (6x6) about the root origin, [angular, linear]. Cone with its apex at the origin
/// and its axis along -e3: M_ri of [Renda] 3.3 with the centre of mass at -3/4 L_r ([physics.md]
/// 4).
Matrix6 RigidInertia(const RigidBody& body);
double RigidVolume(const RigidBody& body);
double RigidMass(const RigidBody& body);
/// Centre of mass, which is also taken as the centre of buoyancy.
Vector3 RigidCentre(const RigidBody& body);

}  // namespace mantle::model
