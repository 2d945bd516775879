#pragma once

#include "firmware_sim/canopen/motor_data.h"

namespace mantle::firmware_sim {

/// Temperatures of winding and housing [deg C], two heat capacities in line.
struct ThermalModel {
  double winding_c{22.0};
  double housing_c{22.0};

  /// Advances by `step_s` (far below tau_w1) with `power_w` lost in the winding.
  void Advance(const MotorData& data, double power_w, double ambient_c, double step_s);
};

/// The mean current over a step as a linear function of the mean speed: at_rest - slope * omega.
struct MeanCurrent {
  double at_rest_a;
  double slope_a_s;
};

/// The electrical and thermal half of a DC motor.
///
/// Winding, voltage v and speed omega held over a step h, tau = L/R (exact solution):
///
///   L di/dt = v - R i - k omega,   i_inf = (v - k omega) / R
///   i(t)    = i_inf + (i0 - i_inf) exp(-t/tau)
///   mean i  = i_inf (1 - g) + i0 g,   g = (1 - exp(-h/tau)) tau / h
///   R       = R_22 (1 + alpha (T_w - 22 deg C))
///
/// Heat, two nodes as the data sheet gives them (winding w, housing h, ambient a):
///
///   C_w dT_w/dt = P - (T_w - T_h) / R_th1          C_w = tau_w1 / R_th1
///   C_h dT_h/dt = (T_w - T_h) / R_th1 - (T_h - T_a) / R_th2      C_h = tau_w2 / R_th2
class Winding {
 public:
  Winding(const MotorData& data, double step_s);

  double current_a() const { return current_a_; }
  double resistance_ohm() const { return resistance_ohm_; }

  /// Resistance at a winding temperature; `short_factor` below 1 is a short between turns.
  void SetTemperature(double winding_c, double short_factor);

  MeanCurrent Mean(double voltage_v) const {
    const double steady = (1.0 - mean_weight_) / resistance_ohm_;
    return {voltage_v * steady + current_a_ * mean_weight_, constant_nm_a_ * steady};
  }

  /// Ends the step at mean speed `speed_rad_s`; returns the heat of the step [J].
  double Advance(double voltage_v, double speed_rad_s);

  /// The power stage is open: what the inductance held is lost; returns it as heat [J].
  double Open();

  double magnetic_energy_j() const { return 0.5 * inductance_h_ * current_a_ * current_a_; }

 private:
  double cold_resistance_ohm_;
  double inductance_h_;
  double constant_nm_a_;
  double copper_per_k_;
  double reference_c_;
  double step_s_;
  double resistance_ohm_{0.0};
  double decay_{0.0};        ///< exp(-h/tau)
  double mean_weight_{0.0};  ///< g
  double current_a_{0.0};
};

}  // namespace mantle::firmware_sim
