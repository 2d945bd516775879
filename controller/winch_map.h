#pragma once

namespace mantle::controller {

/// Between a cable's tension and the torque of the winch that pulls it, friction included. With r
/// the reeled length, s = dr/d(motor angle), T the tension at the drum, eta the gear's efficiency
/// ([physics.md] 2, firmware_sim/drive/winch.h):
///
///   torque = a s T + sigma (M_R + b s T) + (J / s) d2r/dt2
///   a = (1/eta + eta) / 2,   b = (1/eta - eta) / 2
///
/// sigma in [-1, 1] is the direction of the friction: the sign of the reel's rate while it moves
/// (positive reels in), anything between while it stands. Torques are in 1/1000 of the rated one,
/// as a CiA 402 drive takes and reports them.
struct WinchMap {
  double metres_per_rad{0};  ///< s, of the motor
  double metres_per_count{0};
  double gear_efficiency{1};
  double friction_torque_nm{0};  ///< M_R, sliding
  double stiction_ratio{1};      ///< static over sliding friction
  double inertia_kgm2{0};        ///< J, at the motor
  double permille_nm{0};         ///< torque of one unit
  double max_permille{1000};

  double mean_load() const { return 0.5 * (1.0 / gear_efficiency + gear_efficiency); }
  double load_friction() const { return 0.5 * (1.0 / gear_efficiency - gear_efficiency); }
  /// Mass of rotor and drum as the cable feels it [kg].
  double mass_kg() const { return inertia_kgm2 / (metres_per_rad * metres_per_rad); }
};

/// Throws std::invalid_argument with name, value and bound.
void CheckWinchMap(const WinchMap& map);

/// Sliding friction at the drum under `tension_n` [N].
double FrictionForce(const WinchMap& map, double tension_n);

/// Torque [1/1000 of rated] for `tension_n` at the drum, unlimited.
double TensionToTorque(const WinchMap& map, double tension_n, double sigma,
                       double acceleration_m_s2 = 0.0);

/// Tension at the drum [N] that a torque holds; the inverse of TensionToTorque, not below zero.
double TorqueToTension(const WinchMap& map, double torque_permille, double sigma,
                       double acceleration_m_s2 = 0.0);

}  // namespace mantle::controller
