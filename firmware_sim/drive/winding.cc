#include "firmware_sim/drive/winding.h"

#include <cmath>

namespace mantle::firmware_sim {

void ThermalModel::Advance(const MotorData& data, double power_w, double ambient_c, double step_s) {
  const double winding_capacity = data.winding_time_constant_s / data.winding_to_housing_k_w;
  const double housing_capacity = data.housing_time_constant_s / data.housing_to_ambient_k_w;
  const double inner_w = (winding_c - housing_c) / data.winding_to_housing_k_w;
  const double outer_w = (housing_c - ambient_c) / data.housing_to_ambient_k_w;
  winding_c += step_s * (power_w - inner_w) / winding_capacity;
  housing_c += step_s * (inner_w - outer_w) / housing_capacity;
}

Winding::Winding(const MotorData& data, double step_s)
    : cold_resistance_ohm_(data.resistance_ohm),
      inductance_h_(data.inductance_h),
      constant_nm_a_(data.torque_constant_nm_a),
      copper_per_k_(data.copper_per_k),
      reference_c_(data.reference_c),
      step_s_(step_s) {
  SetTemperature(data.reference_c, 1.0);
}

void Winding::SetTemperature(double winding_c, double short_factor) {
  resistance_ohm_ =
      cold_resistance_ohm_ * short_factor * (1.0 + copper_per_k_ * (winding_c - reference_c_));
  const double ratio = step_s_ * resistance_ohm_ / inductance_h_;
  decay_ = std::exp(-ratio);
  mean_weight_ = -std::expm1(-ratio) / ratio;
}

double Winding::Advance(double voltage_v, double speed_rad_s) {
  const double steady_a = (voltage_v - constant_nm_a_ * speed_rad_s) / resistance_ohm_;
  const double off_a = current_a_ - steady_a;
  const double tau_s = inductance_h_ / resistance_ohm_;
  const double square_a2s = steady_a * steady_a * step_s_ +
                            2.0 * steady_a * off_a * tau_s * (1.0 - decay_) +
                            0.5 * off_a * off_a * tau_s * (1.0 - decay_ * decay_);
  current_a_ = steady_a + off_a * decay_;
  return resistance_ohm_ * square_a2s;
}

double Winding::Open() {
  const double lost_j = magnetic_energy_j();
  current_a_ = 0.0;
  return lost_j;
}

}  // namespace mantle::firmware_sim
