#pragma once

#include <numbers>

namespace mantle::firmware_sim {

/// Figures of the simulated drive, each once.
///
/// Motor: FAULHABER DC-micromotor series 1524 ... SR, order number 1524T012SR, data sheet
/// "DC-Micromotors Series 1524 ... SR, precious metal commutation, 2,9 mNm" (Dr. Fritz Faulhaber
/// GmbH & Co. KG, EN_1524_SR_DFF), values at 22 deg C and nominal voltage; the number of the row of
/// the data sheet stands behind each figure. Gear, drum, encoder, brake and power stage are this
/// project's choices for a cable of 0 to 1 N, marked "chosen".
struct MotorData {
  double nominal_voltage_v{12.0};         // row 1
  double resistance_ohm{19.8};            // row 2, at 22 deg C
  double friction_torque_nm{0.08e-3};     // row 7
  double torque_constant_nm_a{11.5e-3};   // row 10; row 9 is the same number
  double inductance_h{420e-6};            // row 13
  double rotor_inertia_kgm2{0.56e-7};     // row 15
  double winding_to_housing_k_w{10.0};    // row 17, Rth1
  double housing_to_ambient_k_w{29.0};    // row 17, Rth2
  double winding_time_constant_s{5.6};    // row 18, tau_w1
  double housing_time_constant_s{220.0};  // row 18, tau_w2
  double max_winding_c{125.0};            // row 19
  double reference_c{22.0};               // heading of the table
  double rated_torque_nm{2.9e-3};         // row 29
  double no_load_speed_rad_s{9800.0 / 60.0 * 2.0 * std::numbers::pi};  // row 4
  double no_load_current_a{0.007};                                     // row 5
  double stall_torque_nm{6.92e-3};                                     // row 6

  /// Temperature coefficient of copper's resistivity at 20 deg C (CRC Handbook of Chemistry and
  /// Physics, "Electrical resistivity of pure metals").
  double copper_per_k{0.0039};
  /// Static over Coulomb friction, chosen within the range 1 to 2 of lubricated bearings
  /// (Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083).
  double stiction_ratio{1.3};
};

/// Gear, drum, brake and encoder behind the motor.
struct WinchData {
  double gear_ratio{4.0};            // motor turns per drum turn; chosen
  double gear_efficiency{0.9};       // one planetary stage, both directions of power; chosen
  double feed_um_per_turn{31416.0};  // object 6092; a drum of 5.0000 mm radius; chosen
  double drum_inertia_kgm2{2.0e-8};  // POM disc of 10 mm diameter, 10 mm long, 1.1 g; chosen
  double brake_torque_nm{10e-3};     // at the motor shaft, above the stall torque; chosen
  int counts_per_turn{2048};         // 512 lines, four edges; chosen
  /// A slack-rope switch on the cable guide opens below this tension; chosen.
  double slack_tension_n{0.01};
};

/// Limits of the power stage; chosen.
struct PowerStageData {
  double supply_v{12.0};
  double over_voltage_v{16.0};
  double under_voltage_v{9.0};
  /// Trip of the over-current comparator: above every current the limits 6072 allow.
  double over_current_a{0.8};
  double max_board_c{85.0};
  double max_winding_c{115.0};      // ten kelvin below the data sheet's limit
  double winding_warning_c{100.0};  // statusword bit 7; a trip is over only below it
};

/// Objects 6075 and 6076. 6076 counts whole mN m: 2.9 becomes 3; the current that gives 3 mN m is
/// 3 / 11.5 A = 261 mA.
inline constexpr int kRatedCurrent_ma = 261;
inline constexpr int kRatedTorque_mnm = 3;

}  // namespace mantle::firmware_sim
