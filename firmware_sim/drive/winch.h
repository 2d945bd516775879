#pragma once

#include <cstdint>

#include "firmware_sim/canopen/motor_data.h"
#include "firmware_sim/drive/winding.h"

namespace mantle::firmware_sim {

inline constexpr std::int64_t kSubStep_us = 100;
inline constexpr double kSubStep_s = 1e-6 * static_cast<double>(kSubStep_us);

/// The cable as the drum feels it, around the length where the plant evaluated it:
///
///   T = max(0, tension + tension_rate t + stiffness (reeled - at_reeled) + damping d(reeled)/dt)
///
/// with t since the load was set and the rate what the cable's other end does by itself. A drive
/// without a plant hauls a spring: tension 0 at the reeled length where the slack is taken up.
struct CableLoad {
  double tension_n{0.0};
  double stiffness_n_m{0.0};
  double at_reeled_m{0.0};
  double damping_n_s_m{0.0};
  double tension_rate_n_s{0.0};
};

/// What surrounds the winch.
struct Surroundings {
  double ambient_c{22.0};
  double winding_short_factor{1.0};  ///< below 1: turns are shorted
  CableLoad cable{};                 ///< its tension is that at the beginning of a sub-step
};

/// What the power stage does over a sub-step.
struct WinchCommand {
  bool powered{false};  ///< false: the winding is open
  double voltage_v{0.0};
  bool brake_closed{true};
};

/// Sums since construction [J]: supply = ohmic + friction + cable + change of stored.
struct WinchEnergy {
  double supply_j{0.0};
  double ohmic_j{0.0};
  double friction_j{0.0};  ///< bearings, gear, brake
  double cable_j{0.0};     ///< work done on the cable: integral of T d(reeled)
};

/// Motor, gear, drum, brake and encoder of one cable, in sub-steps of 0.1 ms.
///
/// One equation at the motor shaft, s = drum radius / gear ratio, T the cable's tension:
///
///   J domega/dt = k i - a s T - M_f,     d(reeled)/dt = s omega
///   a = (1/eta + eta) / 2,  b = (1/eta - eta) / 2
///
/// The gear's efficiency eta acts against the motion both ways (s T / eta hauling, s T eta paying
/// out), which is the mean load a s T and a friction b s T. Dry friction M_f = M_R + b s T (+
/// brake) is set-valued at rest: the step solves for the speed with the friction inside, so the
/// rotor sticks exactly while the rest of the torque stays below the static level (time stepping of
/// Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988). Winding,
/// back-EMF, inertia and cable are solved together by the midpoint rule in omega: stable for any
/// stiffness, and the energies below balance to round-off except where the cable goes slack within
/// a sub-step.
class Winch {
 public:
  explicit Winch(const MotorData& motor = {}, const WinchData& winch = {},
                 double step_s = kSubStep_s);

  void Step(const WinchCommand& command, const Surroundings& around);

  /// Winding and housing over `step_s` with the heat since the last call; resistance follows.
  void AdvanceThermal(const Surroundings& around, double step_s);

  double speed_rad_s() const { return speed_rad_s_; }  ///< of the motor
  double angle_rad() const { return angle_rad_; }      ///< of the motor
  double current_a() const { return winding_.current_a(); }
  double resistance_ohm() const { return winding_.resistance_ohm(); }
  double reeled_m() const { return metres_per_rad_ * angle_rad_; }
  double rate_m_s() const { return metres_per_rad_ * speed_rad_s_; }
  double tension_n() const { return tension_n_; }  ///< mean of the last sub-step
  double winding_c() const { return thermal_.winding_c; }
  void SetTemperatures(double winding_c, double housing_c) { thermal_ = {winding_c, housing_c}; }
  std::int64_t encoder_counts() const;

  const WinchEnergy& energy() const { return energy_; }
  double stored_energy_j() const {
    return winding_.magnetic_energy_j() + 0.5 * inertia_kgm2_ * speed_rad_s_ * speed_rad_s_;
  }
  double inertia_kgm2() const { return inertia_kgm2_; }  ///< all of it, at the motor shaft
  double metres_per_rad() const { return metres_per_rad_; }
  /// Torque at the motor that holds `tension_n`, friction apart.
  double HoldingTorque_nm(double tension_n) const {
    return mean_load_ * metres_per_rad_ * tension_n;
  }

 private:
  /// Speed after the step for a linear law: torque = drive - damping * mean speed.
  double Solve(double drive_nm, double damping_nms, double coulomb_nm, double& friction_nm) const;

  MotorData motor_;
  WinchData winch_;
  double step_s_;
  Winding winding_;
  ThermalModel thermal_{};
  double inertia_kgm2_;
  double metres_per_rad_;
  double mean_load_;      ///< a
  double load_friction_;  ///< b
  double angle_rad_{0.0};
  double speed_rad_s_{0.0};
  double tension_n_{0.0};
  double heat_j_{0.0};  ///< since the last AdvanceThermal
  WinchEnergy energy_{};
};

}  // namespace mantle::firmware_sim
