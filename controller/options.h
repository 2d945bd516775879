#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "model/lie.h"

/// What a scene asks of a controller and of its estimator: plain values that the tables [control]
/// and [sensors] give. Motors are the actuators of the table [reduced], in their order; a motor of
/// a closed loop drives cables only.

namespace mantle::controller {

using model::Vector3;

/// The controllers that come along; options.controller may also name one of a user's own
/// (controller/registry.h).
enum class ControllerKind {
  kMpc,
  kGait,     ///< open loop
  kPursuit,  ///< pull towards what is aimed at, on top of the gait
  kPid,      ///< of the heading (or of the tip's place), on top of the gait
  kLqr       ///< on the reduced model at rest, on top of the gait
};
/// "mpc", "gait", "pursuit", "pid", "lqr": what scenes say.
constexpr std::string_view ToString(ControllerKind kind) {
  constexpr std::string_view kNames[] = {"mpc", "gait", "pursuit", "pid", "lqr"};
  return kNames[static_cast<std::size_t>(kind)];
}

enum class MpcMode {
  kRealTimeIteration,  ///< one linearisation at the shifted plan, condensed
  kConverged           ///< repeated until the plan stands still
};

/// How the quadratic program of a linearisation is solved; exactly by either.
enum class SolverMethod {
  kActiveSet,     ///< dual active set (controller/active_set_solver.h)
  kInteriorPoint  ///< what MakeSolver() gives (Ipopt), then the active set that it found
};

/// Nodes t_0 < ... < t_N of the horizon, t_{k+1} - t_k = step growth^k, and the nodes whose
/// tensions are decided; between them the change of the plan is linear. The last node is a knot.
struct ControlGrid {
  int steps{20};
  double step_s{0.05};
  double growth{1};
  std::vector<int> knots;  ///< ascending in 1..steps; empty: eight, denser at the beginning
};

/// Hard limits of one motor [N, N/s].
struct MotorLimits {
  double min_tension_n{0}, max_tension_n{0.8}, max_rate_n_s{2};
  /// Decides at every node of the grid instead of its knots, as the form of a pulse needs.
  bool decides_every_node{false};
};

/// Weights of the stage cost l [1/s], of which the closed loop's cost is the time integral:
///
///   l = position |p - p_ref|^2 + heading |e3 - d_ref|^2 + velocity |v - v_ref|^2
///     + mean_velocity |mean of v over a pulse - v_ref|^2 + turn_rate |omega|^2
///     + tip |p_tip - p_tip_ref|^2 + volume (U / U_0 - 1)^2
///     + sum over motors (effort u^2 + rate u_dot^2)
///
/// `terminal` multiplies the state's part at the horizon's last node [s].
struct CostWeights {
  double position{0};       ///< 1/m^2
  double heading{0};        ///< 1
  double velocity{0};       ///< s^2/m^2
  double mean_velocity{0};  ///< s^2/m^2
  double turn_rate{0};      ///< s^2
  double tip{0};            ///< 1/m^2
  double volume{0};         ///< 1
  double effort{0};         ///< 1/N^2
  double rate{0};           ///< s^2/N^2
  double terminal{0};       ///< s
};

/// weight times the square of what is outside [low, high], added to the stage cost.
struct SoftBound {
  enum class Quantity {
    kVolume,    ///< U / U_0
    kSpeed,     ///< of the root [m/s]
    kTurnRate,  ///< |omega| [rad/s]
    kCurvature  ///< |bending strain| of every group [1/m]
  };
  Quantity quantity{Quantity::kVolume};
  double low{0}, high{0};
  double weight{0};
};

/// Swim along `direction` (world) at a speed averaged over a pulse.
struct CruiseTask {
  Vector3 direction{Vector3::UnitZ()};
  double speed_m_s{0.1};
};
/// Pass the points in turn: the reference moves along the smooth curve from the root's initial
/// place through them, from rest to `speed` within `ramp`.
struct PathTask {
  std::vector<Vector3> waypoints;
  double speed_m_s{0.08};
  double ramp_s{2};
  double tolerance_m{0.0266};  ///< a waypoint is passed where the root comes as close
};
/// The tip of an arm follows a circle about the axis of its base frame, in the plane at `height`;
/// it is approached on a spiral during `approach`.
struct CircleTask {
  int arm{0};
  double radius_m{0.1}, height_m{0.4};
  double period_s{4}, approach_s{2};
};
using ControlGoal = std::variant<CruiseTask, PathTask, CircleTask>;

/// Tension of one motor over a period: from `low` to `high` within the share `rise`, there for the
/// share `hold`, back within `fall`; begins `phase` of a period after t = 0.
struct GaitPulse {
  double low_n{0}, high_n{0};
  double rise{0.5}, hold{0}, fall{0.5};
  double phase{0};
};
/// A periodic pulse of every motor.
struct Gait {
  double period_s{0.66};
  std::vector<GaitPulse> motors;  ///< one per motor
};

/// Parameters of the baselines (controller/baselines.h); `mantle tune` finds them.
struct BaselineGains {
  double gait_scale{1};    ///< of the gait's tensions
  double gait_period{1};   ///< of its period
  double gait_lead_s{0};   ///< by which it acts earlier
  double proportional{2};  ///< pursuit, PID [N/rad; N/m for a tip]
  double integral{0};      ///< PID [N/(rad s); N/(m s)]
  double derivative{0};    ///< pursuit, PID [N s/rad; N s/m]
  double lookahead_s{0};   ///< along the reference
  double lqr_effort{1};    ///< weight of effort and rate over the cost's
  double speed_gain{0};    ///< of the gait's scale [1/m of along-track error; s/m of mean speed]
};

/// What is made of measurements: the scene's table [control.estimator].
struct EstimatorOptions {
  std::string type{"model"};  ///< its name in controller/registry.h
  bool observer{false};       ///< the state is filtered; else the measurement is taken as it is
  bool disturbance{true};     ///< a bias of every motor's tension and of a free root's acceleration
  double model_noise{1};      ///< factor on the filter's distrust of the model
  double tension_walk_n{0.01};          ///< of the bias in a second (random walk, N/s^(1/2))
  double acceleration_walk_m_s2{7e-4};  ///< of the root, alike
  bool current{false};                  ///< the velocity of uniform water is estimated
  double current_walk_m_s{1e-3};        ///< of that, alike
  double gate{50};  ///< standard deviations beyond which a measurement is refused; 0: never
};

/// Everything that a scene's table [control] says.
struct ControlOptions {
  std::string controller{ToString(ControllerKind::kMpc)};  ///< its name in controller/registry.h
  MpcMode mode{MpcMode::kRealTimeIteration};
  ControlGoal goal;
  double period_s{0.05};
  double delay_s{0.01};      ///< from the measurement until its plan acts
  double deadline_s{0.008};  ///< for the solver, in real time
  SolverMethod solver{SolverMethod::kActiveSet};
  int max_iterations{300};  ///< of the solver, always
  ControlGrid grid;
  std::vector<MotorLimits> motors;
  CostWeights cost;
  /// Of the time integral of the squared changes of tensions, as a share of the cost's mean
  /// curvature along it (controller/condensed.h), so that it holds for weights of any scale.
  double levenberg{0.25};
  std::vector<SoftBound> bounds;
  Gait gait;
  std::array<BaselineGains, 4> baselines;  ///< of kGait, kPursuit, kPid, kLqr
  EstimatorOptions estimator;
};

/// Standard deviations of white noise and a constant bias drawn once, on what is measured; delay
/// and losses of whole measurements.
struct SensorOptions {
  double position_m{0}, attitude_rad{0};
  double velocity_m_s{0}, angular_velocity_rad_s{0};
  double strain{0}, strain_rate{0};      ///< of arms [1/m, 1/(m s)]
  double mantle{0}, mantle_rate{0};      ///< shares of the coordinates' scale (and per second)
  double cable_m{0}, cable_rate_m_s{0};  ///< of cable lengths, for the tension loops
  double bias{0};                        ///< standard deviation of the bias over that of the noise
  double delay_s{0};
  double loss{0};  ///< probability of a measurement not to come
  int seed{1};

  bool perfect() const {
    return position_m == 0 && attitude_rad == 0 && velocity_m_s == 0 &&
           angular_velocity_rad_s == 0 && strain == 0 && strain_rate == 0 && mantle == 0 &&
           mantle_rate == 0 && delay_s == 0 && loss == 0;
  }
};

}  // namespace mantle::controller
