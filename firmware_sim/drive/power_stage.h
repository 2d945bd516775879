#pragma once

#include <algorithm>

#include "firmware_sim/canopen/motor_data.h"

namespace mantle::firmware_sim {

/// The current regulator of the power stage, once a sub-step of 0.1 ms:
///
///   v = R i_ref + k omega + v_I,   v_I += 0.1 R (i_ref - i)
///
/// The winding's time constant (21 us) lies below the sub-step, so that it follows the voltage
/// within one sub-step, and the integral removes what temperature and the estimate of omega leave
/// over in some ten sub-steps. The voltage is limited to the supply.
class CurrentRegulator {
 public:
  double Voltage(const MotorData& motor, double reference_a, double current_a, double speed_rad_s,
                 double supply_v) {
    const double needed =
        motor.resistance_ohm * reference_a + motor.torque_constant_nm_a * speed_rad_s + integral_v_;
    const double voltage = std::clamp(needed, -supply_v, supply_v);
    if (voltage == needed) {
      integral_v_ += kIntegralShare * motor.resistance_ohm * (reference_a - current_a);
    }
    return voltage;
  }
  void Reset() { integral_v_ = 0.0; }

 private:
  static constexpr double kIntegralShare = 0.1;
  double integral_v_{0.0};
};

}  // namespace mantle::firmware_sim
