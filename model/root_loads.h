#pragma once

#include "model/loads.h"

/// Loads on the root and on the rigid body that it carries: values that return a wrench about the
/// root's origin, in its frame, from its pose and its twist relative to the water ([Renda] 2.6,
/// [physics.md] 3). Plant, iteration matrix, energy accounts and reduced model walk one list of
/// them. What else a load says of itself is in loads.h.

namespace mantle::model {

/// Weight and buoyancy of the rigid body, (m - rho_w V) R^T G at its centre.
struct RigidGravityLoad {
  Vector3 gravity_m_s2;
  double mass_kg, displaced_kg;  ///< zero where the effect is not named
  Vector3 centre_m;
  int weight_place{-1}, buoyancy_place{-1};

  static std::optional<RigidGravityLoad> From(const Robot& robot);
  static constexpr bool kField = true;
  void Scale(const Mismatch&) {}
  void Name(PowerNames* names);
  Vector6 Wrench(const SectionMotion& root) const;
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const;
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const;
};

/// -c omega3 |omega3| about e3.
struct RollDragLoad {
  double coefficient_n_m_s2;
  int place{-1};

  static std::optional<RollDragLoad> From(const Robot& robot);
  static constexpr bool kField = false;
  void Scale(const Mismatch& m) { coefficient_n_m_s2 *= m.drag; }
  void Name(PowerNames* names) { place = names->Place("roll_drag"); }
  Vector6 Wrench(const SectionMotion& root) const;
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const;
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const;
};

/// Quadratic drag of the rigid body on its projections: -1/2 rho_w C A |v_n| v_n laterally, at the
/// height of the projection's centroid, and along e3.
struct RigidDragLoad {
  double water_density_kg_m3;
  double lateral_coefficient, axial_coefficient;
  double lateral_area_m2, axial_area_m2, height_m;
  int place{-1};

  static std::optional<RigidDragLoad> From(const Robot& robot);
  static constexpr bool kField = false;
  void Scale(const Mismatch& m) {
    lateral_coefficient *= m.drag;
    axial_coefficient *= m.drag;
  }
  void Name(PowerNames* names) { place = names->Place("rigid_drag"); }
  Vector6 Wrench(const SectionMotion& root) const;
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const;
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const;
};

using RootLoad = std::variant<RigidGravityLoad, RollDragLoad, RigidDragLoad, MagneticRootLoad,
                              RigidWaterAccelerationLoad>;

/// Adds `sign` times each wrench in turn; loads of a field times `field_scale`.
void AddRootWrenches(const std::vector<RootLoad>& loads, const SectionMotion& root,
                     double field_scale, double sign, Vector6* sum);
RootTangent RootLoadTangent(const std::vector<RootLoad>& loads, const SectionMotion& root,
                            double field_scale);

/// A slice of lateral drag at height z on the root's axis, -k |u| u with u the axis' lateral
/// velocity there, as a wrench about the origin; and the derivatives of that wrench in the twist,
/// in z and in k. The wrench and each derivative are added to.
void AddLateralDragSlice(double k, double z_m, const Vector6& root_twist, Vector6* wrench);
void AddLateralDragSliceTangent(double k, double z_m, const Vector6& root_twist, Matrix6* by_twist,
                                Vector6* by_z, Vector6* by_k);

}  // namespace mantle::model
