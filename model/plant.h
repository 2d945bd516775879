#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/block_tridiagonal.h"
#include "model/failure.h"
#include "model/inputs.h"
#include "model/mantle_inertia.h"
#include "model/mantle_loads.h"
#include "model/rod.h"
#include "model/shell.h"

/// @file
/// The full model: a Robot discretised, its state, and the semi-discrete equations
///
///   q_dot = B(q) v,     M(q) v_dot = f(q, v, t)                                   ([physics.md] 4)
///
/// q: root pose, nodal poses of the arms, (r, z, theta) of the mantle's nodes. v: body twists and
/// rates. Flat vectors of v, f and v_dot are laid out root (6), arms' nodes 1..N (6 each), mantle's
/// nodes 0..M (3 each); node 0 of an arm moves with the root. Twists and poses are taken in a frame
/// that drifts with the water's uniform current, which is inertial: loads then need no current
/// (Simulation converts what it reports).
///
/// Coupling. Exact (default): poses and twists of the arms are absolute, the root's balance
/// receives what node 0 of every arm feels, and the mantle's axial motion couples through the mass.
/// Frozen ([Renda] 3.3): poses and twists of the arms are relative to the root, bodies do not feel
/// the root's acceleration, and the root integrates the locked inertia.

namespace mantle::model {

/// The full model of a robot: meshes, inertias and loads, made once and constant from then on. What
/// changes is in PlantState, PlantInputs and PlantWork, and the equations are free functions of
/// those (plant.h has the equations and the layout of the vectors). Throughout, arms, cables, loads
/// and strips keep the order that the robot has them in.
class Plant {
 public:
  /// Throws BadRobot.
  explicit Plant(const Robot& robot);

  /// As described, but for the bodies' factors of its mismatch, which are applied; the loads below
  /// have taken the others.
  Robot robot;
  std::vector<Rod> rods;                   ///< of the robot's arms
  std::optional<Shell> shell;              ///< of its mantle
  MantleWaterOptions water_options;        ///< of the mantle, from the effects
  Matrix6 rigid_inertia{Matrix6::Zero()};  ///< rigid body alone
  Matrix6 root_inertia{Matrix6::Zero()};   ///< with node 0 of every arm where coupling is exact,
                                           ///< not with what the first elements carry
  std::vector<RootLoad> root_loads;
  std::vector<MantleLoad> mantle_loads;
  PowerNames power_names;    ///< of every load, cable and constraint; what is not named is not here
  int constraint_place{-1};  ///< of a root that is not free
  int water_place{-1};       ///< of a current that changes in time
  double body_length_m{0};   ///< errors are relative to it; the robot's, or its reference shape's
  std::vector<double> cable_rest_m;  ///< lengths at rest, as the inputs' cables

  bool exact() const { return robot.coupling == Coupling::kExact; }
  bool root_free() const { return std::holds_alternative<FreeRoot>(robot.root); }
  bool has_gravity() const { return robot.effects.weight || robot.effects.buoyancy; }

  int velocity_size() const { return velocity_size_; }
  int pose_count() const { return pose_count_; }
  int shape_count() const { return shell ? shell->node_count() : 0; }
  /// Index of the pose of `node` of `arm`; its velocity (node >= 1) starts at ArmVelocity.
  int ArmPose(int arm, int node) const { return pose_offset_[arm] + node; }
  int ArmVelocity(int arm, int node) const { return velocity_offset_[arm] + 6 * (node - 1); }
  int ShellVelocity(int node) const { return shell_offset_ + 3 * node; }

  int cable_count() const { return cable_count_; }
  /// First of an arm's muscles and payloads among the inputs'.
  int MuscleIndex(int arm, int muscle) const { return muscle_offset_[arm] + muscle; }
  int PayloadIndex(int arm, int payload) const { return payload_offset_[arm] + payload; }
  int ArmCableIndex(int arm, int cable) const { return cable_offset_[arm] + cable; }
  int SpokeIndex(int k) const { return spoke_offset_ + k; }

 private:
  void MakeLoads();

  std::vector<int> pose_offset_, velocity_offset_, cable_offset_, muscle_offset_, payload_offset_;
  int shell_offset_{6}, velocity_size_{6}, pose_count_{1}, cable_count_{0}, spoke_offset_{0};
};

/// Poses [0] = root, then arms' nodes 0..N; shape = mantle nodes; velocity flat.
struct PlantState {
  double time_s{0};
  std::vector<Pose> pose;      ///< body to world (frozen coupling: arms to root) [m]
  std::vector<Vector3> shape;  ///< (r, z, theta) [m, m, rad]
  VectorX velocity;            ///< v [rad/s, m/s]; mantle [m/s, m/s, rad/s]
};

/// The reference shape where the root is at time t (EvaluateRootMotion), moving with it as a rigid
/// body, plus the initial velocities of the robot's bodies.
PlantState InitialState(const Plant& plant, double t_s = 0);

/// to = from moved by the increment theta (laid out as v): g exp(theta^), shape + theta. Node 0 of
/// each arm follows the root. `to` must have been sized like `from`.
void Retract(const Plant& plant, const PlantState& from, const VectorX& theta, PlantState* to);

/// Values of all schedules at time t; `from_left` as in Value().
void EvaluateInputs(const Plant& plant, double t_s, bool from_left, PlantInputs* inputs);
/// Earliest break point of any schedule after t (infinity if none).
double NextBreakpoint(const Plant& plant, double t_s);
/// Clamped or prescribed root: sets pose and twist of the root (and of every node 0).
void ImposeRoot(const Plant& plant, const PlantInputs& inputs, PlantState* state);

/// Motion of the mass inside an element (model/rod_middle.h) at its place.
struct MiddleState {
  Vector6 twist{Vector6::Zero()};     ///< eta
  Vector6 tau_rate{Vector6::Zero()};  ///< tau_dot of the frame
  Vector6 bias{Vector6::Zero()};      ///< of the twist's rate, what the nodes' rates do not make
  /// Loads and inertial forces but for those of the nodes' accelerations.
  Vector6 wrench{Vector6::Zero()};
};

/// Everything that one evaluation computes; allocated once by the constructor.
struct PlantWork {
  explicit PlantWork(const Plant& plant);

  VectorX force;                                  ///< f(q, v, t)
  std::vector<std::vector<Vector6>> twist;        ///< per arm and node, the twist loads see
  std::vector<std::vector<RodElementState>> rod;  ///< per arm and element
  std::vector<std::vector<MiddleState>> middle;   ///< per arm and element, its twist as `twist`
  std::vector<std::vector<Vector3>> muscles;      ///< moment of the muscles per element; or none
  std::vector<double> payloads;                   ///< as the inputs' of the last EvaluateForces
  std::vector<ShellElementState> shell;           ///< per element of the mantle
  std::vector<Vector3> volume_gradient;           ///< dU/d(r, z, theta) per node [m^2]
  std::vector<double> cable_length_m, cable_rate_m_s, cable_tension_n;  ///< as the inputs' cables
  Matrix6 root_mass{Matrix6::Zero()};                                   ///< M_rr
  MantleInertia mantle_inertia;
  CavityMoments cavity;  ///< where the scene names an effect that needs it
  double volume_m3{0}, volume_rate_m3_s{0}, flux_m3_s{0}, thrust_n{0};  ///< U, U_dot; Q, T
  double radial_flux_m3_s{0};  ///< part of the volume's rate that radial velocity makes
  double mean_axial_speed_m_s{0}, mantle_drag_n{0}, max_radius_m{0};  ///< of AxialDragLoad
  std::vector<Vector3> scratch, gradient_scratch;  ///< one per node of the mantle
  VectorX flat;                                    ///< scratch, laid out as v
  std::vector<BlockTridiagonal<6>> mass;           ///< of SolveAcceleration, per arm
  std::vector<VectorX> mass_rhs;
};

/// Fills `work`. No allocation.
EvaluationFailure EvaluateForces(const Plant& plant, const PlantState& state,
                                 const PlantInputs& inputs, PlantWork* work);

/// out = M(q) a for the q of the last EvaluateForces. Rows of held coordinates are zero.
void ApplyMass(const Plant& plant, const PlantWork& work, const VectorX& a, VectorX* out);

/// a = M(q)^-1 f; held coordinates get zero, a clamped root zero, a prescribed root its
/// acceleration. O(N), no allocation: an arm's mass couples neighbouring nodes, and is eliminated
/// from the tip in `work`.
void SolveAcceleration(const Plant& plant, const PlantInputs& inputs, PlantWork* work, VectorX* a);

/// What loads on the mantle read of a state that EvaluateForces has filled `work` for.
ShellMotion MantleMotionOf(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                           const PlantWork& work);

/// At a break point of a prescribed root: the root takes its twist's limit from the right, and the
/// bodies the velocities that the support's impulse gives them, M(q) dv = 0 in every row but the
/// root's (the mantle, whose z is relative to the root, keeps its absolute axial velocity). Poses
/// do not change. `inputs` receives the limits from the right, `work` the evaluation after the
/// impulse. Does nothing to a root that is free or has no kink there.
EvaluationFailure CrossRootKink(const Plant& plant, PlantInputs* inputs, PlantWork* work,
                                PlantState* state);

/// Inertia of the payloads that are attached to a node, about its origin; zero without any.
Matrix6 PayloadInertia(const Plant& plant, const PlantWork& work, int arm, int node);

/// Absolute pose and twist of a node, whatever the coupling.
Pose AbsolutePose(const Plant& plant, const PlantState& state, int arm, int node);
Vector6 AbsoluteTwist(const Plant& plant, const PlantState& state, int arm, int node);
/// Those of the mass inside an element.
struct PlaceMotion {
  Pose pose;
  Vector6 twist;
};
PlaceMotion AbsoluteMiddle(const Plant& plant, const PlantState& state, int arm, int element);

}  // namespace mantle::model
