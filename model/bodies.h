#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "model/lie.h"
#include "model/schedule.h"

/// @file
/// What a robot is made of: plain values, entered once. SI units; body frames; 6-vectors are
/// (angular, linear). model/robot.h has the whole.

namespace mantle::model {

/// Isotropic Kelvin-Voigt material.
struct Material {
  double young_pa{0};
  double poisson{0};
  double viscosity_pa_s{0};  ///< shear viscosity; used where the scene names the effect "viscosity"
  double density_kg_m3{0};

  double shear_pa() const { return young_pa / (2.0 * (1.0 + poisson)); }
};

/// The water around the robot: at rest or in a uniform current (Effects::current_m_s), without a
/// surface or a bottom.
struct Water {
  double density_kg_m3{1022};
};

/// Tension that pulls on a cable, given as a function of time.
struct GivenTension {
  Schedule tension_n;
};
/// Tension that pulls on a cable from a reeled length with elasticity, u = max(0, k (l - l_reel) +
/// d (l_dot - l_reel_dot)) ([physics.md] 2).
struct ReeledLength {
  Schedule length_change_m;  ///< l_reel minus the cable's length at rest; negative pulls
  double stiffness_n_m{0};   ///< k
  double damping_n_s_m{0};   ///< d
};
/// What pulls on a cable.
using CableDrive = std::variant<GivenTension, ReeledLength>;

/// A cable along an arm at offset d(X) = fraction h(X) (0, cos a, sin a), a = angle + turns 2 pi
/// X/L, from the base to `end_m` (arc length).
struct ArmCable {
  std::string name;
  double fraction{0.6};  ///< of the section's radius, 0 to 1
  double angle_rad{0};   ///< in the section, from y towards z
  double turns{0};       ///< about the arm over its whole length
  double end_m{0};       ///< arc length
  CableDrive drive;
  /// Any path instead: points (X, y, z) [m], X ascending; offsets linear between them, constant
  /// beyond the ends. `fraction`, `angle_rad` and `turns` are then not used.
  std::vector<Vector3> path{};
};

enum class LoadFrame { kBody, kWorld };  ///< turns with the section (follower), or not (dead)

/// Wrench density w(X, t) = direction shape(X) schedule(t) [N m/m, N/m];
/// shape = base + (tip - base) X/L.
struct DistributedWrench {
  std::string name;
  Vector6 direction{Vector6::Zero()};  ///< [N m/m, N/m], in `frame`
  double base{1}, tip{1};
  LoadFrame frame{LoadFrame::kBody};  ///< of the section, or the world
  Schedule schedule;                  ///< a factor
  /// An actuator's, whose reaction the root receives; or the world's. Absent: an actuator's where
  /// the load turns with the section.
  std::optional<bool> internal{};
};

/// A muscle that tends to bend (or twist) the sections by a moment that travels along the arm:
///
///   m(X, t) = axis amplitude(t) e(X, t) sin(2 pi (phi(t) - X / wave_length(t)) + phase),
///   phi(t) = int_0^t frequency dt,
///
/// towards the tip where frequency > 0. It is an internal moment of the section, Sigma (xi - xi*) -
/// m: it shifts the curvature at rest by Sigma^-1 m, works on the rate of curvature, and acts on
/// the root through the arm's base alone.
struct MuscleWave {
  /// A point of e(X): its arc length [m], its value over time.
  struct Envelope {
    double at_m{0};
    Schedule factor{ConstantSchedule{1}};
  };
  std::string name;
  Vector3 axis{Vector3::UnitZ()};  ///< unit vector: twist, bending about y, about z
  Schedule amplitude_n_m, wave_length_m, frequency_hz;
  double phase_rad{0};
  /// e(X): linear between these arc lengths, constant beyond; empty: 1.
  std::vector<Envelope> envelope;
};

/// A quantity that changes linearly along a piece.
struct Taper {
  double base{0}, tip{0};
  double At(double share) const { return base + (tip - base) * share; }
};
/// A circle or, hollow, a ring.
struct RoundOutline {
  Taper radius_m, inner_radius_m;  ///< inner 0: solid
};
/// A solid rectangle.
struct RectangularOutline {
  Taper width_m, height_m;  ///< along y, along z of the section
};

/// A piece of an arm: outline and material, or the section's matrices themselves.
struct ArmPiece {
  double length_m{0};
  std::variant<RoundOutline, RectangularOutline> outline;
  Material material;
  double shear_correction{1};
  bool flooded{false};  ///< a hollow one holds water: it displaces its wall alone
  bool rigid{false};
  bool node_at_end{true};              ///< false: only the taper changes there
  std::optional<Matrix6> stiffness{};  ///< [N m^2, N m, N], symmetric, positive definite
  std::optional<Vector6> viscosity{};  ///< diagonal [N m^2 s, N s]
  std::optional<Vector6> inertia{};    ///< diagonal [kg m, kg/m]
};

/// A rigid body carried by a section.
struct Payload {
  std::string name;
  double at_m{0};                          ///< arc length
  Vector3 offset_m{Vector3::Zero()};       ///< of its centre from the section's
  double mass_kg{0};                       ///< > 0
  Matrix3 inertia_kg_m2{Matrix3::Zero()};  ///< about its centre, axes of the section
  double volume_m3{0};                     ///< of water displaced, at its centre
  std::optional<double> drop_s{};          ///< it leaves the arm at this time
};

/// Velocity at t = 0 in a mode of vibration of the arm clamped alone, with its added mass.
struct InitialMode {
  int number{1};        ///< from 1, in the order of frequencies
  double speed_m_s{0};  ///< of the node that moves fastest
};

/// Strains along an arm, linear between the arc lengths, constant beyond.
struct StrainTable {
  std::vector<double> at_m;
  std::vector<Vector6> strain;  ///< twist, curvatures [rad/m], stretch (1: none), shears
};

/// Wrench at arc length `at_m` [N m, N].
struct PointWrench {
  std::string name;
  double at_m{0};
  Vector6 wrench{Vector6::Zero()};  ///< in `frame`, at the section's centre
  LoadFrame frame{LoadFrame::kWorld};
  Schedule schedule;  ///< a factor
};

/// A Cosserat rod, straight along +x of its base frame or curved at rest: of one tapered circular
/// section, or of pieces.
struct Arm {
  std::string name;
  Pose mount;  ///< base frame in the root frame
  double length_m{0};
  double radius_base_m{0}, radius_tip_m{0};
  Material material;
  double shear_correction{1};  ///< k of the shear stiffness k G A
  /// Sections given as a diagonal instead of from material and geometry (torsion, bending y, z,
  /// stretch, shear y, z); constant along the arm.
  std::optional<Vector6> stiffness;            ///< [N m^2, N]
  std::optional<Vector6> viscosity;            ///< [N m^2 s, N s]
  std::optional<Vector6> inertia;              ///< [kg m, kg/m]
  Vector3 curvature_base{Vector3::Zero()};     ///< twist and curvatures at rest [rad/m], base ...
  Vector3 curvature_tip{Vector3::Zero()};      ///< ... and tip, linear between
  Vector3 drag_coefficients{Vector3::Zero()};  ///< C_x, C_y, C_z
  double added_mass_coefficient{0};            ///< B_b
  int elements{20};                            ///< of equal length, but for nodes moved to `points`
  std::vector<ArmCable> cables;
  std::vector<DistributedWrench> distributed;
  std::vector<PointWrench> points;
  /// Velocity at t = 0, relative to the root, as a fraction of the first bending mode: tip speed
  /// [m/s] along y of the base frame.
  double initial_mode1_tip_speed_m_s{0};
  Vector6 initial_twist{Vector6::Zero()};  ///< rigid twist of the whole arm, about its base frame
  std::vector<InitialMode> initial_modes{};
  std::optional<StrainTable> initial_strain{};  ///< shape at t = 0; absent: as at rest
  /// From base to tip; their lengths add up to `length_m`. Not empty: instead of radius, material,
  /// shear correction, stiffness, viscosity and inertia above.
  std::vector<ArmPiece> pieces{};
  std::vector<MuscleWave> muscles{};
  std::vector<Payload> payloads{};
};

/// A piece of the meridian: a straight line or an arc of constant curvature.
struct MeridianPiece {
  double length_m{0};
  double curvature_1_m{0};  ///< d theta / dX; negative bends from e_r towards -e3
};

enum class ShellEnd {
  kClamped,    ///< r, z, theta held
  kSupported,  ///< r, z held
  kSymmetric,  ///< mirror plane (z, theta held), or on the axis (r, theta held)
  kFree
};

/// Inward radial dead load per reference area on X in [from, to] ([physics.md] 3, erratum 12).
struct StripPressure {
  std::string name;
  double from_m{0}, to_m{0};  ///< arc lengths of the meridian
  Schedule pressure_pa;
};

/// n spokes that draw the strip in: p = c u, c = n / A; cable length n times the mean r of the
/// strip.
struct SpokeCable {
  std::string name;
  double from_m{0}, to_m{0};  ///< arc lengths of the meridian
  int spokes{8};
  CableDrive drive;
};

/// The mantle: axisymmetric Reissner shell about e3 of the root frame ([physics.md] 3).
struct Mantle {
  std::string name;
  double r0_m{0}, z0_m{0}, theta0_rad{0};  ///< meridian at X = 0
  std::vector<MeridianPiece> pieces;       ///< end to end, from X = 0
  double half_thickness_m{0};
  Material material;
  ShellEnd start{ShellEnd::kClamped}, end{ShellEnd::kFree};  ///< at X = 0, and at the other end
  int elements{64};                                          ///< of the plant's mesh
  /// Last over first element length along the whole meridian (> 1: finer at X = 0).
  double grading{1};
  /// Arc lengths that must be nodes, besides piece ends and strips.
  std::vector<double> stations_m;
  double nozzle_radius_m{0};
  int outlets{1}, inlets{3};         ///< nozzles that the water leaves and enters by
  double added_mass_coefficient{0};  ///< B_s
  double drag_coefficient{0};        ///< C_d
  std::vector<StripPressure> strips;
  std::vector<SpokeCable> spokes;
  double initial_radial_speed_m_s{0};  ///< outwards, of every node that is free
};

/// A solid cone of one density with its apex at the root's origin and its axis along -e3.
struct Cone {
  double radius_m{0}, height_m{0}, density_kg_m3{0};
};
/// Mass properties about the root origin: Inertia (6x6, symmetric), displaced volume, centroid.
struct GivenInertia {
  double mass_kg{0};
  Vector3 centre_m{Vector3::Zero()};       ///< of mass, and of buoyancy; root frame
  Matrix3 inertia_kg_m2{Matrix3::Zero()};  ///< about the centre of mass, root frame
  double volume_m3{0};
};
/// The rigid body that the root carries: its mass properties, by shape or as numbers.
struct RigidBody {
  std::string name;
  std::variant<Cone, GivenInertia> shape;
};

/// Factors by which a robot differs from its description, as a plant does from a controller's
/// model. What each one acts on is said by the materials (model/mismatch.h) and by every load
/// (its `Scale`).
struct Mismatch {
  double young{1}, viscosity{1}, drag{1}, added_mass{1}, jet{1};

  bool none() const {
    return young == 1 && viscosity == 1 && drag == 1 && added_mass == 1 && jet == 1;
  }
};

/// All bodies of a robot, and the water around them: what its effects act on.
struct Bodies {
  Water water;
  std::vector<Arm> arms;
  std::optional<Mantle> mantle;
  std::optional<RigidBody> rigid_body;
};

}  // namespace mantle::model
