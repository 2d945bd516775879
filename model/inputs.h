#pragma once

#include <vector>

#include "model/robot.h"

/// What drives a robot at one instant: the values of its schedules, or what a controller and its
/// drives put in their place.

namespace mantle::model {

/// What drives the cables: a tension, or a reel.
struct CableInput {
  bool reeled{false};
  double tension_n{0};
  double reel_m{0}, reel_rate_m_s{0};  ///< absolute reel length (rest length + change) and rate
  double stiffness_n_m{0}, damping_n_s_m{0};
};

/// Tension [N] of a cable of this length and rate; a reeled cable goes slack instead of pushing.
double CableTension(const CableInput& input, double length_m, double rate_m_s);

/// A muscle's wave at one instant: amplitude e(X) sin(phase - wave_number X).
struct MuscleInput {
  double amplitude_n_m{0}, phase_rad{0}, wave_number_1_m{0};
  int first_envelope{0};  ///< its factors in PlantInputs::envelopes
};

/// The uniform water at one instant, in the earth's frame.
struct WaterMotion {
  Vector3 velocity_m_s{Vector3::Zero()};
  Vector3 drift_m{Vector3::Zero()};  ///< way since t = 0
  Vector3 acceleration_m_s2{Vector3::Zero()};
};
WaterMotion EvaluateWater(const Effects& effects, double t_s, bool from_left = false);

/// Every schedule's value at one instant; also what a controller or drives write.
struct PlantInputs {
  std::vector<CableInput> cables;   ///< arms in order, cables in order; then the mantle's spokes
  std::vector<double> distributed;  ///< arms in order, loads in order
  std::vector<double> points;
  std::vector<MuscleInput> muscles;  ///< arms in order, muscles in order
  std::vector<double> envelopes;     ///< of all muscles
  std::vector<double> payloads;      ///< 1 attached, 0 dropped; arms in order, payloads in order
  std::vector<double> strips_pa;
  double normal_pressure_pa{0};
  double gravity_scale{1};  ///< load stepping in statics: of every load of a field
  Vector3 water_acceleration_m_s2{Vector3::Zero()};  ///< of the current, world frame
  Pose root_pose;                                    ///< prescribed root only
  Vector6 root_twist{Vector6::Zero()};
  Vector6 root_acceleration{Vector6::Zero()};
};

/// Values of all schedules at time t; `from_left` as in Value(). `cable_rest_m`: lengths at rest
/// of the cables, in the order of PlantInputs::cables.
void EvaluateInputs(const Robot& robot, const std::vector<double>& cable_rest_m, double t_s,
                    bool from_left, PlantInputs* inputs);
/// Earliest break point of any schedule after t (infinity if none).
double NextBreakpoint(const Robot& robot, double t_s);

}  // namespace mantle::model
