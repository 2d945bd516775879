#include "loop/control_side/simulated_winch.h"

#include <numbers>

#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/motor_data.h"

namespace mantle::loop {

controller::WinchMap SimulatedWinch() {
  constexpr firmware_sim::MotorData kMotor;
  constexpr firmware_sim::WinchData kWinch;
  controller::WinchMap map;
  const double drum_rad_m = 1e-6 * kWinch.feed_um_per_turn / (2.0 * std::numbers::pi);
  map.metres_per_rad = drum_rad_m / kWinch.gear_ratio;
  map.metres_per_count = map.metres_per_rad * 2.0 * std::numbers::pi / kWinch.counts_per_turn;
  map.gear_efficiency = kWinch.gear_efficiency;
  map.friction_torque_nm = kMotor.friction_torque_nm;
  map.stiction_ratio = kMotor.stiction_ratio;
  map.inertia_kgm2 = kMotor.rotor_inertia_kgm2 +
                     kWinch.drum_inertia_kgm2 / (kWinch.gear_ratio * kWinch.gear_ratio);
  map.permille_nm = 1e-3 * 1e-3 * firmware_sim::kRatedTorque_mnm;
  return map;
}

std::vector<firmware_sim::ExpectedObject> ExpectedOfWinch() {
  namespace object = firmware_sim::object;
  constexpr firmware_sim::WinchData kWinch;
  constexpr std::uint32_t kVendor = 0, kProduct = 0x402;  // as the electronic data sheet says
  constexpr std::uint32_t kModes = 0x380;                 // 8, 9, 10
  return {{{object::kIdentity, 1}, kVendor},
          {{object::kIdentity, 2}, kProduct},
          {{object::kSupportedModes, 0}, kModes},
          {{object::kRatedCurrent, 0}, firmware_sim::kRatedCurrent_ma},
          {{object::kRatedTorque, 0}, firmware_sim::kRatedTorque_mnm},
          {{object::kEncoderResolution, 1}, kWinch.counts_per_turn},
          {{object::kEncoderResolution, 2}, 1},
          {{object::kGearRatio, 1}, static_cast<std::uint32_t>(kWinch.gear_ratio)},
          {{object::kGearRatio, 2}, 1},
          {{object::kFeedConstant, 1}, static_cast<std::uint32_t>(kWinch.feed_um_per_turn)},
          {{object::kFeedConstant, 2}, 1}};
}

}  // namespace mantle::loop
