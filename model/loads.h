#pragma once

#include <variant>
#include <vector>

#include "model/robot.h"
#include "model/water_acceleration.h"

/// @file
/// Loads on a section of an arm: each a pure value that returns a wrench density (per unit
/// reference length, section frame) from the section's geometry and its absolute pose and twist.
/// The plant sums them over nodes, the reduced model projects the same functions at its quadrature
/// points. Added mass is not here: it belongs in the inertia ([physics.md] 2, errata 1 and 2).
///
/// Every load, here and in root_loads.h and mantle_loads.h, also says
///   From        itself, where the scene names its effect (a new load needs no more than that
///               and its place in a list of types below),
///   kField      whether it comes from a field that load stepping scales with everything else,
///   Scale       which factors of a Mismatch it takes,
///   Name        under what name (and so at which place) it reports its power,
///   AddPower    that power [W], given the twist with which it works.
/// Those on sections also say whether they are exactly nothing (a neutral body's gravity), and
/// whether they read the section's rotation.

namespace mantle::model {

/// Of every body: gravity's work on its mass and on the water that it displaces.
inline constexpr const char* kWeightName = "weight";
inline constexpr const char* kBuoyancyName = "buoyancy";

/// rho_b A R^T G (weight), -rho_w A R^T G (buoyancy); erratum 4. Kept as one load with the
/// difference of the densities, so that a neutral body feels exactly nothing.
struct GravityLoad {
  Vector3 gravity_m_s2;                            ///< G, world frame
  double body_density_kg_m3, water_density_kg_m3;  ///< zero where the effect is not named
  bool by_section{false};                          ///< the body's density is the section's
  int weight_place{-1}, buoyancy_place{-1};        ///< see PowerNames

  static std::optional<GravityLoad> From(const Arm& arm, const Water& water,
                                         const Effects& effects);
  static constexpr bool kField = true;
  bool IsNothing() const { return !by_section && body_density_kg_m3 == water_density_kg_m3; }
  double BodyDensity(const SectionGeometry& s) const {
    return by_section ? s.density_kg_m3 : body_density_kg_m3;
  }
  bool NeedsRotation() const { return true; }
  void Scale(const Mismatch&) {}
  void Name(const std::string& body, PowerNames* names);
  void AddPower(const SectionGeometry& s, const SectionMotion& m, const Vector6& working_twist,
                double scale, double* power_w) const;
  Vector6 Density(const SectionGeometry& s, const SectionMotion& m) const;
  void AddTangent(const SectionGeometry& s, const SectionMotion& m, LoadTangent* t) const;
};

/// -rho_w |v| h diag(pi/2 C_x, C_y, C_z) v ([Renda] 2.6, [physics.md] 2), h the radius; of a
/// rectangle, in each direction what faces the flow (SectionGeometry::drag_shape).
struct DragLoad {
  double water_density_kg_m3;
  Vector3 coefficients;  ///< C_x, C_y, C_z
  int place{-1};         ///< see PowerNames

  static std::optional<DragLoad> From(const Arm& arm, const Water& water, const Effects& effects);
  static constexpr bool kField = false;
  bool IsNothing() const { return false; }
  bool NeedsRotation() const { return false; }
  void Scale(const Mismatch& m) { coefficients *= m.drag; }
  /// Coefficients times the section's shape.
  Vector3 Shape(const SectionGeometry& s) const;
  void Name(const std::string& body, PowerNames* names);
  void AddPower(const SectionGeometry& s, const SectionMotion& m, const Vector6& working_twist,
                double scale, double* power_w) const;
  Vector6 Density(const SectionGeometry& s, const SectionMotion& m) const;
  void AddTangent(const SectionGeometry& s, const SectionMotion& m, LoadTangent* t) const;
};

/// direction shape(X), in the section frame (follower) or the world frame (dead), per unit of the
/// schedule's value, by which the caller scales density and tangent.
struct DistributedLoad {
  Vector6 direction;           ///< [N m/m, N/m]
  double base, tip, length_m;  ///< shape = base + (tip - base) X / length
  LoadFrame frame;             ///< of `direction`
  /// Its reaction is on the root, so that the vehicle's momentum does not change ([Renda] 3.3).
  bool internal{frame == LoadFrame::kBody};

  Vector6 Density(const SectionGeometry& s, const SectionMotion& m) const;
  void AddTangent(const SectionGeometry& s, const SectionMotion& m, LoadTangent* t) const;
};

inline bool IsInternal(const DistributedLoad& load) { return load.internal; }

/// Ours, and those of the effects that have one (Effect::SectionLoad).
using SectionLoad = NamedEffects::SectionLoads<GravityLoad, DragLoad, WaterAccelerationLoad>;

/// Those that the effects make, on an arm.
std::vector<SectionLoad> SectionLoads(const Arm& arm, const Water& water, const Effects& effects);

/// `field_scale` for loads of a field, 1 for others.
template <typename Load>
double FieldScale(const Load&, double field_scale) {
  return Load::kField ? field_scale : 1.0;
}
inline double FieldScale(const SectionLoad& load, double field_scale) {
  return std::visit([&](const auto& l) { return FieldScale(l, field_scale); }, load);
}

/// Of the types `Load`, those that `From(arguments...)` makes, in that order.
template <typename Variant, typename... Load, typename... Arguments>
void AddLoads(std::vector<Variant>* loads, const Arguments&... arguments) {
  const auto add = [&](const auto& load) {
    if (load) loads->push_back(*load);
  };
  (add(Load::From(arguments...)), ...);
}

/// Wrench seen in the section frame of a wrench given in `frame`.
Vector6 WrenchInSection(const Vector6& wrench, LoadFrame frame, const Eigen::Quaterniond& rotation);

/// Diagonal of the section's screw inertia rho diag(I, J, J, A, A, A) [kg m, kg/m] ([Renda] 2.4).
Vector6 SectionInertia(double density_kg_m3, double radius_m);

/// rho_w B A: added mass per unit length in the two lateral directions (F = diag(0, A B, A B)).
double SectionAddedMass(double water_density_kg_m3, double coefficient, double radius_m);

/// Diagonals Sigma = diag(G I, E J, E J, E A, k G A, k G A) and
/// Upsilon = eta diag(I, 3 J, 3 J, 3 A, A, A) of a circular section ([Renda] eq. 7).
Vector6 SectionStiffness(const Material& material, double shear_correction, double radius_m);
Vector6 SectionViscosity(const Material& material, double radius_m);

}  // namespace mantle::model
