#pragma once

#include "model/loads.h"

/// @file
/// Loads on the root and on the rigid body that it carries: values that return a wrench about the
/// root's origin, in its frame, from its pose and its twist relative to the water ([Renda] 2.6,
/// [physics.md] 3). Plant, iteration matrix, energy accounts and reduced model walk one list of
/// them. What else a load says of itself is in loads.h.

namespace mantle::model {

/// Weight and buoyancy of the rigid body, (m - rho_w V) R^T G at its centre.
struct RigidGravityLoad {
  Vector3 gravity_m_s2;                      ///< G, world frame
  double mass_kg, displaced_kg;              ///< zero where the effect is not named
  Vector3 centre_m;                          ///< root frame
  int weight_place{-1}, buoyancy_place{-1};  ///< see PowerNames

  static std::optional<RigidGravityLoad> From(const Robot& robot);
  static constexpr bool kField = true;
  void Scale(const Mismatch&) {}
  void Name(PowerNames* names);
  Vector6 Wrench(const SectionMotion& root) const;
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const;
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const;
};

/// Ours, and those of the effects that have one (Effect::RootLoad).
using RootLoad = NamedEffects::RootLoads<RigidGravityLoad, RigidWaterAccelerationLoad>;

/// Those that the robot's effects make, on its root.
std::vector<RootLoad> RootLoads(const Robot& robot);

/// Adds `sign` times each wrench in turn; loads of a field times `field_scale`.
void AddRootWrenches(const std::vector<RootLoad>& loads, const SectionMotion& root,
                     double field_scale, double sign, Vector6* sum);
RootTangent RootLoadTangent(const std::vector<RootLoad>& loads, const SectionMotion& root,
                            double field_scale);

}  // namespace mantle::model
