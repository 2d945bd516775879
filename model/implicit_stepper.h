#pragma once

#include <array>
#include <string>

#include "model/newton_matrix.h"
#include "model/reel_tensions.h"
#include "model/sdirk.h"
#include "model/stepper.h"

/// @file
/// Singly diagonally implicit Runge-Kutta methods in a chart centred at the step's start
/// (Munthe-Kaas): with g = g_n exp(Theta^) the unknowns (Theta, v) live in a vector space,
///   Theta_dot = Jr^-1(Theta) v,   M v_dot = f,
/// so the method keeps its classical order. Stage i with known parts Theta_k, v_k:
///   Theta = Theta_k + gamma h Theta_dot,  v = Jr(Theta) (Theta - Theta_k) / (gamma h),
///   v_dot = (v - v_k) / (gamma h),        residual M v_dot - f = 0 for Theta,
/// by simplified Newton iterations with a matrix kept over stages and steps while it contracts
/// well. All methods are stiffly accurate: the last stage is the step.
///
/// Newton's iteration stops at a share of the step's own error (model/sdirk.h): what it leaves of
/// Theta is 1 / (gamma h) times as large in v, and adds up step by step. Reeled cables' tensions
/// are unknowns of their own (model/reel_tensions.h).
///
/// implicit_stepper.cc has the steps, their error and what a restart needs, implicit_stage.cc the
/// solution of a stage.

namespace mantle::model {

/// The implicit integrators: Newton's iteration in a chart at each step's start, with a matrix kept
/// while it contracts.
class ImplicitStepper final : public Stepper {
 public:
  ImplicitStepper(const Plant& plant, const StepperSettings& settings);

  StepStatus Step(double h, PlantState* state, EnergyAccount* energy) override;

  const VectorX& acceleration() const override { return guess_; }
  const StepCounters& counters() const override { return counters_; }
  const PlantWork* end_work() const override { return &work_; }

  void Restart() override;
  void CrossBreakpoint() override { smooth_ = false; }

  std::string SaveMemory() const override;

  void RestoreMemory(const std::string& memory) override;

 private:
  // Largest components of an increment or a velocity, in rad and body lengths. The root has a
  // figure of its own: what is left there moves the whole robot, and is not to hide behind a fast
  // tip.
  struct Size {
    double root{0}, all{0};
  };

  // Every number a restart needs, to save it or to restore it. The matrix is a function of the
  // state it was made at, which is small.
  template <typename Number>
  void WalkMemory(Number number);

  void Inputs(double t, bool from_left);

  // Of increments, from the error of the steps so far.
  Size Tolerance(double h) const;

  // Error-controlled steps need the acceleration at their start also where it is not the last
  // step's.
  bool FindStart(const PlantState& state);

  // Local error of v in error_. Across a break point there is no derivative to take it from: what
  // Newton's iteration goes by stays.
  void EstimateError(double h);

  // Of the step's error to step_tolerance. What is faster than the step is damped by the method,
  // and in the estimate by A^-1 s^2 M (Hairer & Wanner II, IV.8).
  double ErrorRatio(double h, const VectorX& start_velocity);

  Size Measure(const VectorX& x) const;

  // v_dot at time c h of the step, extrapolated through the last two stages.
  void Guess(int stage, double h, VectorX* guess) const;

  bool Attempt(double h, const PlantState& start, EnergyAccount* energy);

  // From theta_: stage_ (pose, shape, velocity), theta_rate_ and acceleration_.
  void Unpack(const PlantState& start, double t, double s);

  // theta_ -= Jr^-1(theta) zeta, zeta in residual_; returns its scaled size.
  Size Correct();

  bool SolveStage(const PlantState& start, double t, bool from_left, double s);

  // Forces at stage_ under the tensions as they are taken.
  bool Evaluate();

  bool Factor(double t, bool from_left, double s);

  const Plant& plant_;
  StepperSettings settings_;
  Sdirk tableau_;
  NewtonMatrix matrix_;
  PlantWork work_;
  PlantInputs inputs_;
  ReelTensions reels_;
  PlantState stage_, matrix_state_;
  VectorX theta_, theta_known_, theta_rate_, velocity_known_, acceleration_, residual_;
  VectorX matrix_acceleration_;  // where matrix_ was made
  // v_dot at the end of the last step and earlier_s_ before it, as far as they are known (known_ of
  // them), and whether the next step continues them.
  VectorX guess_, earlier_, error_;
  VectorX start_;  // v_dot where the step starts, from the right
  double earlier_s_{0};
  int known_{0};
  bool smooth_{false};
  Size error_rate_;  // local error of v over h^(p+1); zero where it is not known
  std::array<VectorX, 3> theta_rates_, accelerations_;
  StepCounters counters_;
  std::string reason_;
  double matrix_s_{0}, contraction_{0.1};
  bool matrix_valid_{false}, matrix_from_left_{false};
};

}  // namespace mantle::model
