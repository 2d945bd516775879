#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/failure.h"
#include "reduced/arm_dynamics.h"
#include "reduced/mantle.h"

namespace mantle::reduced {

/// State of the reduced model: within a step in the frame that drifts with the water's current,
/// between plant and controller, and all over the controller, in the earth's (water_frame.h).
struct ReducedState {
  double time_s{0};
  Pose root;     ///< body to world [m]
  VectorX q, v;  ///< arms' strains [rad/m, 1], mantle's s [kg^(1/2) m]; v as in ReducedModel
};

/// The reduced model of a Robot: root pose on SE(3), strain coordinates of the arms, shape
/// coordinates of the mantle, with exact coupling ([physics.md] 4) and the scene's own effects.
///
///   q = (arms' coordinates, mantle's), v = (root's body twist, q_dot),
///   R(g, q, v, a; inputs) = M(q) a - f = 0,
/// evaluated as inverse dynamics. K = dR/d(zeta, q), D = dR/dv, M = dR/da and dR/du are exact; the
/// root's increments zeta are in its body frame (g exp(zeta^)). Poses and twists are taken in a
/// frame that drifts with the water's uniform current, as the plant's; CurrentStep (water_frame.h)
/// steps states that are the earth's.
///
/// Here are its constants alone, made from a robot by ReducedPlant (reduced/build/reduced_plant.h);
/// what runs the model needs no more than this. Nothing in it changes: state, inputs and
/// ReducedWork do.
class ReducedModel {
 public:
  ReducedModel(const ReducedModel&) = delete;
  ReducedModel& operator=(const ReducedModel&) = delete;

  model::Robot robot;                           ///< as the plant's
  std::vector<double> cable_rest_m;             ///< as the inputs' cables
  std::vector<ReducedArm> arms;                 ///< in the robot's order
  std::unique_ptr<const ReducedMantle> mantle;  ///< null where there is none
  std::vector<Actuator> actuators;              ///< the motors: one entry of u each
  Matrix6 rigid_inertia{Matrix6::Zero()};       ///< of the rigid body, about the root's origin
  std::vector<model::RootLoad> root_loads;
  double body_length_m{0};  ///< errors are relative to it
  ReducedState start;       ///< see InitialState

  bool root_free() const { return std::holds_alternative<model::FreeRoot>(robot.root); }
  int coordinate_count() const { return coordinates_; }
  int velocity_count() const { return 6 + coordinates_; }
  /// First coordinate of an arm or of the mantle; its velocity is 6 further on.
  int arm_first(int a) const { return arm_first_[a]; }
  int mantle_first() const { return mantle_first_; }
  int input_count() const { return static_cast<int>(actuators.size()); }
  /// Place of a cable or of a set of spokes among the inputs' cables.
  int ArmCableIndex(int arm, int cable) const { return cable_first_[arm] + cable; }
  int SpokeIndex(int k) const { return spoke_first_ + k; }

 protected:
  ReducedModel() = default;
  ~ReducedModel() = default;

  std::vector<int> arm_first_, cable_first_;
  int mantle_first_{0}, coordinates_{0}, spoke_first_{0};
};

/// Reference shape, at rest relative to the root, at the robot's initial pose and root twist.
ReducedState InitialState(const ReducedModel& model);

/// Values of all schedules at time t; `from_left` as in model::Value().
void EvaluateInputs(const ReducedModel& model, double t_s, bool from_left,
                    model::PlantInputs* inputs);

/// Empty, or how the state's sizes differ from the model's ("q has 3 entries, must be 19").
std::string SizeComplaint(const ReducedModel& model, const ReducedState& state);

/// Overwrites every input that an actuator drives with the sum of gain times u: tensions of cables
/// (or lengths of their reels), amplitudes, pressures. u has input_count() entries.
void ApplyControls(const ReducedModel& model, const double* u, model::PlantInputs* inputs);

/// Everything that one evaluation computes; allocated once by the constructor.
struct ReducedWork {
  explicit ReducedWork(const ReducedModel& model);

  std::vector<ArmWork> arms;       ///< in the robot's order
  std::vector<MantleWork> mantle;  ///< none or one
  VectorX residual;                ///< R, laid out as v
};

using ReducedFailure = model::EvaluationFailure;

/// work->residual = M(q) a - f. Rows of a root that is not free hold the wrench its support exerts.
/// No allocation.
ReducedFailure EvaluateResidual(const ReducedModel& model, const ReducedState& state,
                                const VectorX& acceleration, const model::PlantInputs& inputs,
                                ReducedWork* work);

/// Allocated once.
struct ReducedJacobians : Linearisation {
  explicit ReducedJacobians(const ReducedModel& model);
  Eigen::MatrixXd input;  ///< dR/du, velocity_count x input_count
};

/// At the state of the last EvaluateResidual (same arguments). No allocation. `with_inputs` leaves
/// dR/du out where it is not needed.
void Linearise(const ReducedModel& model, const ReducedState& state, const VectorX& acceleration,
               const model::PlantInputs& inputs, bool with_inputs, ReducedWork* work,
               ReducedJacobians* out);

/// The semi-discrete acceleration; a root that is not free gets inputs.root_acceleration. For
/// checks and outputs: the step solves its stages by itself.
ReducedFailure SolveAcceleration(const ReducedModel& model, const ReducedState& state,
                                 const model::PlantInputs& inputs, ReducedWork* work,
                                 ReducedJacobians* jacobians, VectorX* acceleration);

/// At a break point of a prescribed root, with the inputs' limits from the right: the root takes
/// its new twist, and the coordinates the rates that the support's impulse gives them, M_qq dq_dot
/// = -M_qr d(twist). As model::CrossRootKink does to the plant.
ReducedFailure CrossRootKink(const ReducedModel& model, const model::PlantInputs& inputs,
                             ReducedWork* work, ReducedJacobians* jacobians, ReducedState* state);

}  // namespace mantle::reduced
