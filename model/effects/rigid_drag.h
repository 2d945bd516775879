#pragma once

#include <optional>

#include "model/schema.h"
#include "model/section.h"

namespace mantle::model {

/// The effect `rigid_drag`: quadratic drag of the rigid body, -1/2 rho_w C A |v_n| v_n on what it
/// projects laterally, at the height of that projection's centroid, and along e3.
struct RigidDrag {
  double lateral_coefficient{1.1}, axial_coefficient{1.0};  ///< C
  std::optional<double> lateral_area_m2, axial_area_m2;     ///< A; default: the cone's projections

  struct RootLoad;
  static constexpr const char* kName = "rigid_drag";
  static constexpr bool kOnVelocity = true;
  static constexpr const char* kWithoutPotential = nullptr;

  static void Read(schema::Visitor& v, std::optional<RigidDrag>* effect);
  /// Demands a rigid body and, where that is not a cone, areas.
  static void Check(schema::Visitor& v, const RigidDrag& drag, const Bodies& bodies);
};

/// Projected areas seen laterally and along e3, and the height [m] at which the drag acts: for a
/// cone h L, pi h^2 and the centroid -2/3 L of the lateral projection.
struct RigidDragGeometry {
  double lateral_area_m2, axial_area_m2, height_m;
};
RigidDragGeometry DragGeometry(const RigidBody& body, const RigidDrag& drag);

/// Its wrench on the root.
struct RigidDrag::RootLoad {
  double water_density_kg_m3;
  double lateral_coefficient, axial_coefficient;    ///< C, laterally and along e3
  double lateral_area_m2, axial_area_m2, height_m;  ///< A, and where the lateral drag acts on e3
  int place{-1};                                    ///< see PowerNames

  static std::optional<RootLoad> From(const RigidDrag& drag, const Bodies& bodies);
  static constexpr bool kField = false;
  void Scale(const Mismatch& m) {
    lateral_coefficient *= m.drag;
    axial_coefficient *= m.drag;
  }
  void Name(PowerNames* names) { place = names->Place(kName); }
  Vector6 Wrench(const SectionMotion& root) const;
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const;
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const {
    power_w[place] += scale * Wrench(root).dot(working_twist);
  }
};

}  // namespace mantle::model
