#pragma once

#include "model/robot.h"
#include "model/section.h"

/// What a current that changes in time does to a body besides its drag. In the frame that drifts
/// with the water (model/plant.h), which then accelerates by a, a body of mass m that displaces V
/// feels the frame's -m a and the pressure gradient of the water, rho_w V a:
///
///   (rho_w V - m) R^T a   at its centre, body frame.
///
/// Added mass needs no term: it goes with the motion through the water. A neutral body feels
/// nothing and drifts with the water (Batchelor, An Introduction to Fluid Dynamics, 1967, 6.4).
/// In the earth's frame the gradient works: rho_w V a . v, under the name `water_acceleration`; so
/// does a on the impulse of the added mass (model/energy.h).

namespace mantle::model {

inline constexpr const char* kWaterAccelerationName = "water_acceleration";

/// Per length of an arm.
struct WaterAccelerationLoad {
  double water_density_kg_m3;
  int place{-1};

  static constexpr bool kField = false;
  static std::optional<WaterAccelerationLoad> From(const Arm&, const Water& water,
                                                   const Effects& effects) {
    if (!effects.unsteady_current) return std::nullopt;
    return WaterAccelerationLoad{water.density_kg_m3};
  }
  bool IsNothing() const { return false; }
  bool NeedsRotation() const { return true; }
  void Scale(const Mismatch&) {}
  void Name(const std::string&, PowerNames* names) { place = names->Place(kWaterAccelerationName); }
  Vector6 Density(const SectionGeometry& s, const SectionMotion& m) const {
    Vector6 w = Vector6::Zero();
    w.tail<3>() = (water_density_kg_m3 - s.density_kg_m3) * s.area_m2 * Acceleration(m);
    return w;
  }
  void AddTangent(const SectionGeometry& s, const SectionMotion& m, LoadTangent* t) const {
    t->force_by_rotation += Hat(Density(s, m).tail<3>());
  }
  void AddPower(const SectionGeometry& s, const SectionMotion& m, const Vector6& working_twist,
                double scale, double* power_w) const {
    power_w[place] +=
        scale * water_density_kg_m3 * s.area_m2 * Acceleration(m).dot(working_twist.tail<3>());
  }

 private:
  static Vector3 Acceleration(const SectionMotion& m) {
    return m.rotation.conjugate() * m.water_acceleration_m_s2;
  }
};

/// Of the rigid body on the root, or a payload.
struct RigidWaterAccelerationLoad {
  double mass_kg, displaced_kg;
  Vector3 centre_m;
  int place{-1};

  static std::optional<RigidWaterAccelerationLoad> From(const Robot& robot);
  static constexpr bool kField = false;
  void Scale(const Mismatch&) {}
  void Name(PowerNames* names) { place = names->Place(kWaterAccelerationName); }
  Vector6 Wrench(const SectionMotion& root) const {
    return At((displaced_kg - mass_kg) * Acceleration(root));
  }
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const {
    const Matrix3 turn = scale * (displaced_kg - mass_kg) * Hat(Acceleration(root));
    t->by_rotation.topRows<3>() += Hat(centre_m) * turn;
    t->by_rotation.bottomRows<3>() += turn;
  }
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const {
    power_w[place] += scale * At(displaced_kg * Acceleration(root)).dot(working_twist);
  }

 private:
  static Vector3 Acceleration(const SectionMotion& root) {
    return root.rotation.conjugate() * root.water_acceleration_m_s2;
  }
  Vector6 At(const Vector3& force) const {
    Vector6 w;
    w << centre_m.cross(force), force;
    return w;
  }
};

}  // namespace mantle::model
