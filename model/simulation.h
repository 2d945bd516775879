#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/energy.h"
#include "model/plant.h"
#include "model/start_state.h"
#include "model/step_cap.h"
#include "model/step_control.h"
#include "model/stepper.h"
#include "model/validity.h"

namespace mantle::model {

/// A payload that left its arm: with what it had then (the earth's frame).
struct PayloadDrop {
  int payload{0};  ///< Plant::PayloadIndex
  std::string name;
  double time_s{0};
  Vector3 centre_m{Vector3::Zero()}, velocity_m_s{Vector3::Zero()};
  Vector3 momentum_kg_m_s{Vector3::Zero()};
  double kinetic_energy_j{0};
};
/// Name of a payload by its place among the inputs', "arm.payload".
std::string PayloadName(const Plant& plant, int payload);
/// Payloads that leave at the state's time.
std::vector<PayloadDrop> DropsAt(const Plant& plant, const PlantState& state);

/// How long a run is, by which steps, and what it keeps account of.
struct RunSettings {
  double duration_s{1};
  double step_s{0.01};      ///< of fixed steps; the longest of error-controlled ones
  double min_step_s{1e-6};  ///< retries stop there
  double output_interval_s{0.01};
  StepperSettings stepper;
  bool account_energy{true};  ///< works, drift, indices
  StaticsSettings statics;    ///< of a run that starts from its equilibrium
};

/// What an observer sees at t = 0, every output interval and the end. All of it is the earth's, a
/// current added back, but for the energetic index, which is of the motion through the water.
struct Sample {
  double time_s{0};
  Pose root;                                   ///< body to world [m]
  Vector6 root_twist{Vector6::Zero()};         ///< body frame [rad/s, m/s]
  Vector6 root_acceleration{Vector6::Zero()};  ///< rate of root_twist's components [rad/s^2, m/s^2]
  std::vector<Pose> tips;                      ///< of the arms, body to world [m]
  std::vector<Vector6> tip_twists;             ///< section frame [rad/s, m/s]
  Vector3 centre_of_mass_m{Vector3::Zero()};   ///< of the solid, world
  Vector6 momentum{Vector6::Zero()};           ///< EvaluateMomentum [kg m^2/s, kg m/s]
  double volume_m3{0}, volume_rate_m3_s{0}, thrust_n{0};  ///< enclosed by the mantle; the jet's
  Energies energies;
  std::vector<double> cable_length_m, cable_rate_m_s, cable_tension_n;  ///< as the inputs' cables
  double index_output_w{0};  ///< W_o = eta_r^T M_r eta_r_dot ([physics.md] 5)
  double index_input_w{0};   ///< W_i, positive part of the stress power of shell and arms
  /// Of power_balance_scale_w: the sum of all powers' magnitudes at this instant, or, where those
  /// vanish, a millionth of the largest such sum so far or the energy over the run's duration.
  double power_balance_residual{0};
  double power_balance_scale_w{0};
};

/// Everything a sample says of a state whose forces and acceleration are known, but for the indices
/// and the balance. Adds the current back.
Sample ObserveState(const Plant& plant, const PlantState& state, const PlantWork& work,
                    const VectorX& acceleration);

/// The energetic index in every reading ([physics.md] 5), over all steps of the run.
struct EnergeticIndex {
  double mean_of_ratio{0};                   ///< time mean of W_o / W_i where W_i > 0
  double ratio_of_means{0};                  ///< mean W_o / mean W_i
  double positive_mean_of_ratio{0};          ///< time mean of max(W_o, 0) / W_i where W_i > 0
  double positive_ratio_of_means{0};         ///< mean max(W_o, 0) / mean W_i
  double mean_output_w{0}, mean_input_w{0};  ///< W_o, W_i
};

/// What a run has come to: how it ended, its figures and its last sample.
struct RunResult {
  bool ok{false};
  std::string reason;    ///< what stopped it: time, body, node, cause
  double sim_time_s{0};  ///< reached
  StepCounters counters;
  double power_balance_residual{0};  ///< largest over the samples (exact coupling)
  double power_balance_scale_w{0};   ///< what it is relative to, at that sample
  bool balance_defined{true};  ///< false for frozen coupling: the two figures then mean nothing
  double energy_drift{0};      ///< |E(T) - E(0) - work + dissipated| over energy_drift_scale_j
  /// Largest energy of the run, or the sum of the works' magnitudes and the dissipated energy.
  double energy_drift_scale_j{0};
  std::vector<std::string> warnings;  ///< what looks wrong, and what to do about it
  LargestStrain largest_strain;       ///< over the samples
  std::optional<LobedBucklingMargin> lobed_buckling;
  EnergeticIndex index;
  Sample last;
  std::vector<std::string> work_names;  ///< as EnergyAccount::names
  std::vector<double> work_j;           ///< since t = 0
  double dissipated_j{0};               ///< by viscosity, since t = 0
  std::vector<PayloadDrop> drops;
};

/// Puts what a run's record says into its result, with the warnings that follow from it.
void AddValidity(const Plant& plant, const ValidityRecord& record, RunResult* result);

/// Not ok, in words, where the jet's thrust exceeds the scene's bound: its law has run away.
StepStatus JudgeThrust(const Plant& plant, double time_s, double thrust_n);

/// A run: steps aligned with break points and output times, retried at half the step where they
/// fail, with energies and indices accounted. Plain values out; no files here.
class Simulation {
 public:
  /// Throws BadRobot; std::runtime_error where an explicit step is beyond its stability limit.
  Simulation(const Plant& plant, const RunSettings& settings);

  double time_s() const { return state_.time_s; }
  const PlantState& state() const { return state_; }
  PlantState* mutable_state() { return &state_; }
  const Plant& plant() const { return plant_; }
  StepCounters counters() const;

  /// Advances to time t_s (an output or break point need not lie there).
  StepStatus AdvanceTo(double t_s);
  /// Forces, cable lengths and rates at the present state, as the last step left them (evaluated
  /// now only where the integrator ends a step with nothing evaluated).
  const PlantWork& EndWork();
  /// Works of loads and cables since t = 0; all zero where RunSettings.account_energy is off.
  const EnergyAccount& energy() const { return energy_; }
  Sample Observe();

  /// All of a run. `observer` sees every sample; returning false stops the run there (not an
  /// error).
  RunResult Run(const std::function<bool(const Sample&)>& observer = {});
  /// What the run has come to so far, for a caller that advances it by himself.
  RunResult Result();

  /// Text of everything a resumed run needs; restoring it continues with the same bits.
  std::string Checkpoint() const;
  /// Throws BadRobot where the checkpoint is of another robot or damaged.
  void Restore(const std::string& checkpoint);

 private:
  /// Powers below this share of the run's largest are round-off of the stresses: a balance is not
  /// relative to them.
  static constexpr double kNegligiblePower = 1e-6;

  StepStatus TakeStep(double limit_s);
  void AccountStep(double h);
  StepStatus CrossKink();
  void DropPayloads();
  void Judge(RunResult* result) const;  // fills its warnings
  StepStatus CheckRunaway() const;

  const Plant& plant_;
  RunSettings settings_;
  PlantState state_;
  std::unique_ptr<Stepper> stepper_;
  EnergyAccount energy_, probe_;
  PlantInputs inputs_;
  PlantWork work_;
  VectorX acceleration_;
  mutable std::vector<Vector3> gradient_;
  StepCounters before_resume_;
  std::vector<PayloadDrop> drops_;
  StepCap step_cap_;
  StepControl step_control_;
  // What the run has accumulated; all of it in a checkpoint.
  struct Account {
    double initial_energy_j{0}, peak_energy_j{0};
    double ratio_s{0}, positive_ratio_s{0}, ratio_time_s{0}, time_s{0};
    double output_j{0}, positive_output_j{0}, input_j{0};
    double largest_scale_w{0}, worst_balance{0}, worst_balance_scale_w{0};
    double start_imbalance_w{0}, start_scale_w{0};  // before the first step
    ValidityRecord validity;
  } account_;
};

}  // namespace mantle::model
