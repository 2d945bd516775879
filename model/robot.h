#pragma once

#include <optional>
#include <string>
#include <variant>

#include "model/bodies.h"
#include "model/named_effects.h"

/// @file
/// What a robot is: plain values, entered once, from which the plant and the reduced model are
/// built. The robot is a star ([physics.md] 1): a root frame (free, clamped or with prescribed
/// motion) that carries any number of arms, at most one mantle, and at most one rigid body
/// (model/bodies.h). SI units; body frames; 6-vectors are (angular, linear). Effects are optional
/// values: what is absent is not computed.

namespace mantle::model {

struct FreeRoot {};
struct ClampedRoot {};
/// Displacement sum_i axis_i schedule_i(t) [m] and rotation about a fixed world axis [rad].
struct PrescribedRoot {
  std::optional<Schedule> x_m, y_m, z_m, angle_rad;
  Vector3 rotation_axis{Vector3::UnitZ()};  ///< world frame
};
using RootMotion = std::variant<FreeRoot, ClampedRoot, PrescribedRoot>;

/// The flux Q of the jet law: the rate of the enclosed volume, or its part by the wall's radial
/// velocity.
enum class FluxReading { kVolume, kRadial };
/// Where the thrust acts: all over the wall, or on the dome in proportion to its axial projection,
/// the hole's share on the root.
enum class ThrustPlace { kUniform, kDome };
/// The effect of the jet, T = -rho_w Q |Q| / A_n along +e3 (JetLoad in model/mantle_loads.h has the
/// law).
struct JetThrust {
  FluxReading flux{FluxReading::kVolume};
  ThrustPlace place{ThrustPlace::kUniform};
  double runaway_n{10};  ///< a thrust beyond this stops the run: the jet law has run away
};
/// The effect of a pressure on the mantle's wall.
struct NormalPressure {
  Schedule pressure_pa;  ///< inside minus outside, follows the wall
};
/// The effect of strip-theory drag across the mantle's axis: per height -1/2 rho_w C 2 r |u| u, u
/// the axis' lateral velocity.
struct LateralDrag {
  double coefficient{1.1};  ///< C
};
/// Uniform water velocity that changes in time, continuously; world frame [m/s].
struct UnsteadyCurrent {
  Schedule x_m_s, y_m_s, z_m_s;
};

/// The effects a scene names. Absent means not computed and not stored.
struct Effects {
  Vector3 gravity_m_s2{0, 0, -9.81};  ///< world frame
  bool weight{false}, buoyancy{false}, drag{false}, added_mass{false}, viscosity{false};
  bool contained_water{false}, lateral_added_mass{false};
  std::optional<JetThrust> jet_thrust;
  std::optional<NormalPressure> normal_pressure;
  std::optional<LateralDrag> lateral_drag;
  NamedEffects named;                  ///< those of a file each
  std::optional<Vector3> current_m_s;  ///< uniform steady water velocity, world frame
  /// Instead: its components in time.
  std::optional<UnsteadyCurrent> unsteady_current;
};

/// How arms and mantle are coupled to the root: in full, or as [Renda] 3.3 has it (model/plant.h).
enum class Coupling { kExact, kFrozen };

/// The shape in which a run starts.
enum class InitialShape {
  kReference,   ///< at rest, or the arms' initial strains
  kEquilibrium  ///< under all loads at t = 0
};

/// A whole robot as a scene describes it, from which Plant and ReducedModel are made: root, bodies,
/// effects, and how its plant differs from it.
struct Robot : Bodies {
  std::string name;
  RootMotion root{FreeRoot{}};
  Pose root_pose;                       ///< at t = 0, in the world
  Vector6 root_twist{Vector6::Zero()};  ///< at t = 0, body frame
  Coupling coupling{Coupling::kExact};
  InitialShape initial{InitialShape::kReference};
  Effects effects;
  Mismatch mismatch;
  double body_length_m{0};  ///< for relative errors; 0: extent of the reference shape
};

}  // namespace mantle::model
