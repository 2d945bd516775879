#pragma once

#include <optional>
#include <string>

#include "model/schema.h"
#include "model/section.h"

namespace mantle::model {

/// The effect `magnetic_field`. A body with a magnetic moment m, fixed in it, in a uniform field B
/// fixed in the world feels the torque
///
///   m x R^T B   in the body's frame, R from body to world,
///
/// per length on the sections of an arm, and on the root. Its potential is -m . R^T B; there is no
/// force in a uniform field (Jackson, Classical Electrodynamics, 3rd ed., 5.7).
struct MagneticField {
  Vector3 field_t{Vector3::Zero()};           ///< B, world frame
  Vector3 root_moment_a_m2{Vector3::Zero()};  ///< root frame
  Vector3 arm_moment_a_m{Vector3::Zero()};    ///< per length, of every arm; section frame

  struct SectionLoad;
  struct RootLoad;
  static constexpr const char* kName = "magnetic_field";
  static constexpr bool kOnVelocity = false;
  static constexpr const char* kWithoutPotential = nullptr;

  static void Read(schema::Visitor& v, std::optional<MagneticField>* effect) {
    using schema::kAnyValue;
    using schema::Quantity;
    MagneticField m;
    if (v.Table(schema::Optional({kName, "turns bodies that carry a magnetic moment: m x B"}),
                [&](schema::Visitor& t) {
                  t.Vector(schema::Required(
                               {.name = "field", .meaning = "uniform, world frame", .unit = "T"}),
                           Quantity::kNumber, kAnyValue, &m.field_t);
                  t.Vector(
                      {.name = "root_moment", .meaning = "of the root, its frame", .unit = "A m^2"},
                      Quantity::kNumber, kAnyValue, &m.root_moment_a_m2);
                  t.Vector({.name = "arm_moment",
                            .meaning = "per length of every arm, section frame",
                            .unit = "A m"},
                           Quantity::kNumber, kAnyValue, &m.arm_moment_a_m);
                })) {
      *effect = m;
    }
  }
};

/// The torque on a body.
struct MagneticTorque {
  Vector3 moment;   ///< [A m] per length of an arm, [A m^2] of the root; body frame
  Vector3 field_t;  ///< B, world frame
  int place{-1};    ///< see PowerNames

  static constexpr bool kField = true;
  void Scale(const Mismatch&) {}
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

/// On the sections of every arm, MagneticField::arm_moment_a_m: torque per length [N].
struct MagneticField::SectionLoad : MagneticTorque {
  static std::optional<SectionLoad> From(const MagneticField& f, const Arm&, const Water&) {
    if (f.arm_moment_a_m.isZero(0.0)) return std::nullopt;
    return SectionLoad{{f.arm_moment_a_m, f.field_t}};
  }
  bool IsNothing() const { return false; }
  bool NeedsRotation() const { return true; }
  void Name(const std::string& arm, PowerNames* names) { place = names->Place("magnetic." + arm); }
  Vector6 Density(const SectionGeometry&, const SectionMotion& m) const { return Torque(m); }
  void AddTangent(const SectionGeometry&, const SectionMotion& m, LoadTangent* t) const {
    t->moment_by_rotation += TorqueByRotation(m);
  }
  void AddPower(const SectionGeometry&, const SectionMotion& m, const Vector6& working_twist,
                double scale, double* power_w) const {
    power_w[place] += scale * Torque(m).dot(working_twist);
  }
};

/// On the root, MagneticField::root_moment_a_m2: torque [N m].
struct MagneticField::RootLoad : MagneticTorque {
  static std::optional<RootLoad> From(const MagneticField& f, const Bodies&) {
    if (f.root_moment_a_m2.isZero(0.0)) return std::nullopt;
    return RootLoad{{f.root_moment_a_m2, f.field_t}};
  }
  void Name(PowerNames* names) { place = names->Place("magnetic.root"); }
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
