#include "firmware_sim/drive/winch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mantle::firmware_sim {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

}  // namespace

Winch::Winch(const MotorData& motor, const WinchData& winch, double step_s)
    : motor_(motor), winch_(winch), step_s_(step_s), winding_(motor, step_s) {
  const double ratio = winch.gear_ratio;
  inertia_kgm2_ = motor.rotor_inertia_kgm2 + winch.drum_inertia_kgm2 / (ratio * ratio);
  metres_per_rad_ = 1e-6 * winch.feed_um_per_turn / kTwoPi / ratio;
  mean_load_ = 0.5 * (1.0 / winch.gear_efficiency + winch.gear_efficiency);
  load_friction_ = 0.5 * (1.0 / winch.gear_efficiency - winch.gear_efficiency);
}

double Winch::Solve(double drive_nm, double damping_nms, double coulomb_nm,
                    double& friction_nm) const {
  const double inertia_rate = inertia_kgm2_ / step_s_;
  const double implicit = inertia_rate + 0.5 * damping_nms;
  const double free_nm = speed_rad_s_ * (inertia_rate - 0.5 * damping_nms) + drive_nm;
  const bool at_rest = speed_rad_s_ == 0.0;
  const double holding_nm = at_rest ? coulomb_nm * motor_.stiction_ratio : coulomb_nm;
  if (std::abs(free_nm) <= holding_nm) {
    friction_nm = -free_nm;
    return 0.0;
  }
  friction_nm = -std::copysign(coulomb_nm, free_nm);
  return (free_nm + friction_nm) / implicit;
}

void Winch::Step(const WinchCommand& command, const Surroundings& around) {
  const double k = motor_.torque_constant_nm_a;
  const double s = metres_per_rad_;
  MeanCurrent mean{0.0, 0.0};
  if (command.powered) {
    mean = winding_.Mean(command.voltage_v);
  } else if (winding_.current_a() != 0.0) {
    const double lost_j = winding_.Open();
    energy_.ohmic_j += lost_j;
    heat_j_ += lost_j;
  }

  const CableLoad& cable = around.cable;
  // Mean tension of the sub-step: spring_n + slope_n_s_rad * mean speed.
  const double spring_n = cable.tension_n + 0.5 * cable.tension_rate_n_s * step_s_ +
                          cable.stiffness_n_m * (s * angle_rad_ - cable.at_reeled_m);
  const double slope_n_s_rad = s * (0.5 * cable.stiffness_n_m * step_s_ + cable.damping_n_s_m);
  const double start_n = spring_n + cable.damping_n_s_m * rate_m_s();
  const bool taut = start_n > 0.0;
  double coulomb_nm = motor_.friction_torque_nm;
  if (command.brake_closed) coulomb_nm += winch_.brake_torque_nm;
  if (taut) coulomb_nm += load_friction_ * s * start_n;

  double friction_nm = 0.0;
  double drive_nm = k * mean.at_rest_a;
  double damping_nms = k * mean.slope_a_s;
  double next = 0.0;
  tension_n_ = 0.0;
  if (taut) {
    const double load = mean_load_ * s;
    next = Solve(drive_nm - load * spring_n, damping_nms + load * slope_n_s_rad, coulomb_nm,
                 friction_nm);
    tension_n_ = spring_n + slope_n_s_rad * 0.5 * (speed_rad_s_ + next);
  }
  if (!taut || tension_n_ < 0.0) {
    tension_n_ = 0.0;
    next = Solve(drive_nm, damping_nms, coulomb_nm, friction_nm);
  }

  const double mid = 0.5 * (speed_rad_s_ + next);
  const double turned_rad = mid * step_s_;
  if (command.powered) {
    const double mean_a = mean.at_rest_a - mean.slope_a_s * mid;
    const double heat_j = winding_.Advance(command.voltage_v, mid);
    energy_.supply_j += command.voltage_v * mean_a * step_s_;
    energy_.ohmic_j += heat_j;
    heat_j_ += heat_j;
  }
  energy_.friction_j += ((mean_load_ - 1.0) * s * tension_n_ - friction_nm) * turned_rad;
  energy_.cable_j += tension_n_ * s * turned_rad;
  angle_rad_ += turned_rad;
  speed_rad_s_ = next;
}

void Winch::AdvanceThermal(const Surroundings& around, double step_s) {
  thermal_.Advance(motor_, heat_j_ / step_s, around.ambient_c, step_s);
  heat_j_ = 0.0;
  winding_.SetTemperature(thermal_.winding_c, around.winding_short_factor);
}

std::int64_t Winch::encoder_counts() const {
  return static_cast<std::int64_t>(std::floor(angle_rad_ / kTwoPi * winch_.counts_per_turn));
}

}  // namespace mantle::firmware_sim
