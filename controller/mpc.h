#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include "controller/condensed.h"
#include "controller/plan.h"

namespace mantle::controller {

enum class Outcome {
  kSolved,         ///< the new plan, to tolerance
  kStoppedBetter,  ///< the solver was stopped; its iterate is feasible and beats the shifted plan
  kShifted,        ///< the shifted plan with its gains
  kSafe            ///< too many in a row: tensions decay to their lower limit
};
std::string_view ToString(Outcome outcome);

/// How the last Prepare and Solve went.
struct MpcStatus {
  Outcome outcome{Outcome::kShifted};
  SolveStatus solver{SolveStatus::kFailed};
  const char* cause{nullptr};  ///< why there was nothing to solve; static life
  int iterations{0};           ///< of the solver, summed over linearisations
  int linearisations{0};
  double prepare_s{0}, solve_s{0};
  double cost{0};  ///< of the plan, by the quadratic model about the true cost
  double stationarity{0}, infeasibility{0}, complementarity{0};
};

/// Counts over a run. Histograms: bin i holds values in [2^i, 2^(i+1)) of 0.125 ms, or iterations
/// i.
struct MpcCounters {
  std::uint64_t solves{0}, solved{0}, stopped_better{0}, shifted{0}, safe{0};
  std::uint64_t deadline_misses{0}, bad_states{0};
  std::uint64_t restarts{0};           ///< plans made anew from the estimate, see Restart
  std::uint64_t fallbacks_in_turn{0};  ///< at the end
  std::array<std::uint64_t, 16> time_histogram{};
  std::array<std::uint64_t, 64> iteration_histogram{};
};

/// Receding-horizon control with the reduced model.
///
/// Real-time iteration: Prepare (before the measurement) shifts the plan to the next start, rolls
/// and linearises the model along it and condenses; Solve (after it) puts the deviation of the
/// measured start from the expected one into the gradient and solves the small quadratic program
/// with Ipopt. Converged: both are repeated at the measured start, each change backed by the true
/// cost (Levenberg-Marquardt), until the plan stands still.
///
/// What can happen to a solve, and what the motors then get, is an Outcome; all of them are
/// counted, none throws.
class Mpc {
 public:
  /// Throws model::BadRobot where the model has no input or the horizon makes no sense.
  Mpc(const ReducedModel& model, const reduced::StepSettings& step, const ControlOptions& options,
      const Reference& reference);

  /// A plan of the gait from here on.
  void Start(const ReducedState& state);

  /// The plan for a start at `expected` (its time is the plan's), with the motors pulling
  /// `tensions` then.
  void Prepare(const ReducedState& expected, const Eigen::Ref<const VectorX>& tensions);

  /// Prepare once more, from the state that the vehicle is now known to have: for an expectation
  /// that could not be rolled, or from which the vehicle has parted (parting.h). Counted.
  void Restart(const ReducedState& start, const Eigen::Ref<const VectorX>& tensions);
  /// The last Prepare succeeded and was not solved yet.
  bool prepared() const { return prepared_; }

  /// Solves for the state that the start is now known to have. `deadline_ns` as in SolveOptions.
  const MpcStatus& Solve(const ReducedState& start, std::int64_t deadline_ns);

  /// Limits of the motors from the next Prepare on, one per motor: those of lost ones are zero.
  void SetLimits(const std::vector<MotorLimits>& limits) { options_.motors = limits; }

  /// A root position that was measured; for costs on the mean velocity. Ignored if not finite.
  void RecordPosition(double t_s, const Vector3& position) {
    if (position.allFinite()) history_.Add(t_s, position);
  }

  const Plan& plan() const { return plan_; }
  const MpcStatus& status() const { return status_; }
  const MpcCounters& counters() const { return counters_; }
  const Horizon& horizon() const { return horizon_; }
  Propagator& propagator() { return propagator_; }
  Condensed& condensed() { return condensed_; }
  const Trajectory& trajectory() const { return trajectory_; }

 private:
  void Shift(double start_s, const Eigen::Ref<const VectorX>& tensions);
  void SolveOnce(std::int64_t deadline_ns);
  void SolveConverged(const ReducedState& start, std::int64_t deadline_ns);
  void Accept(const Eigen::Ref<const VectorX>& w, const ReducedState& start);
  void FallBack();
  void Count();

  const ReducedModel& model_;
  ControlOptions options_;  ///< what is in it but the motors' limits stays
  const Reference& reference_;
  Horizon horizon_;
  StageCost cost_;
  Propagator propagator_;
  Trajectory trajectory_, trial_;
  PositionHistory history_;
  Condensed condensed_;
  std::unique_ptr<Solver> solver_;
  SolveResult result_;
  Plan plan_;
  MpcStatus status_;
  MpcCounters counters_;
  VectorX deviation_, moved_, change_, gait_, gait_end_;
  bool prepared_{false};
  int fallbacks_in_turn_{0};
};

}  // namespace mantle::controller
