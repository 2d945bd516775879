#pragma once

#include "model/section.h"

namespace mantle::model {

/// A body with a magnetic moment m, fixed in it, in a uniform field B fixed in the world: the
/// torque
///
///   m x R^T B   in the body's frame, R from body to world,
///
/// per length on the sections of an arm, and on the root. Its potential is -m . R^T B; there is no
/// force in a uniform field (Jackson, Classical Electrodynamics, 3rd ed., 5.7).
struct MagneticLoad {
  Vector3 moment;   ///< [A m] per length of an arm, [A m^2] of the root; body frame
  Vector3 field_t;  ///< B, world frame
  int place{-1};    ///< see PowerNames

  static constexpr bool kField = true;
  static std::optional<MagneticLoad> Make(const Vector3& moment, const Effects& effects) {
    if (!effects.magnetic_field || moment.isZero(0.0)) return std::nullopt;
    return MagneticLoad{moment, effects.magnetic_field->field_t};
  }
  void Scale(const Mismatch&) {}
  void NameAs(const std::string& body, PowerNames* names) {
    place = names->Place("magnetic." + body);
  }
  Vector6 Torque(const SectionMotion& m) const {
    Vector6 w = Vector6::Zero();
    w.head<3>() = moment.cross(m.rotation.conjugate() * field_t);
    return w;
  }
  /// In the body increment R exp(zeta~), which turns R^T B by (R^T B) x zeta.
  Matrix3 TorqueByRotation(const SectionMotion& m) const {
    return Hat(moment) * Hat(m.rotation.conjugate() * field_t);
  }
};

/// On the sections of every arm, MagneticField::arm_moment_a_m: a SectionLoad, whose density is the
/// torque per length [N].
struct MagneticSectionLoad : MagneticLoad {
  static std::optional<MagneticSectionLoad> From(const Arm&, const Water&, const Effects& e) {
    const auto& field = e.magnetic_field;
    const auto load = Make(field ? field->arm_moment_a_m : Vector3(Vector3::Zero()), e);
    return load ? std::optional(MagneticSectionLoad{*load}) : std::nullopt;
  }
  bool IsNothing() const { return false; }
  bool NeedsRotation() const { return true; }
  void Name(const std::string& arm, PowerNames* names) { NameAs(arm, names); }
  Vector6 Density(const SectionGeometry&, const SectionMotion& m) const { return Torque(m); }
  void AddTangent(const SectionGeometry&, const SectionMotion& m, LoadTangent* t) const {
    t->moment_by_rotation += TorqueByRotation(m);
  }
  void AddPower(const SectionGeometry&, const SectionMotion& m, const Vector6& working_twist,
                double scale, double* power_w) const {
    power_w[place] += scale * Torque(m).dot(working_twist);
  }
};

/// On the root, MagneticField::root_moment_a_m2: a RootLoad, whose wrench is the torque [N m].
struct MagneticRootLoad : MagneticLoad {
  static std::optional<MagneticRootLoad> From(const Robot& robot) {
    const auto& field = robot.effects.magnetic_field;
    const auto load =
        Make(field ? field->root_moment_a_m2 : Vector3(Vector3::Zero()), robot.effects);
    return load ? std::optional(MagneticRootLoad{*load}) : std::nullopt;
  }
  void Name(PowerNames* names) { NameAs("root", names); }
  Vector6 Wrench(const SectionMotion& root) const { return Torque(root); }
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const {
    t->by_rotation.topRows<3>() += scale * TorqueByRotation(root);
  }
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const {
    power_w[place] += scale * Torque(root).dot(working_twist);
  }
};

}  // namespace mantle::model
