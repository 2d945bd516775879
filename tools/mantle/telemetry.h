#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

/// What a run says about itself while it runs, as plain values: field for field the messages of
/// lcm_types/, where units and frames stand. Lists that belong together (all of the arms, of the
/// cables, of the drives, of the knots) have one length.

namespace mantle::tools {

using Triple = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  ///< w, x, y, z
using Twist = std::array<double, 6>;       ///< angular part first

struct StateTelemetry {
  static constexpr const char* kChannel = "MANTLE_STATE";

  std::int64_t utime{0};
  Triple root_position{};
  Quaternion root_quaternion{1, 0, 0, 0};
  Twist root_twist{};
  std::vector<std::string> arm_name;
  std::vector<Triple> tip_position;
  std::vector<Quaternion> tip_quaternion;
  std::vector<Twist> tip_twist;
  Triple centre_of_mass{};
  Triple heading{0, 0, 1};
  double volume{0}, volume_rate{0}, thrust{0};
  std::vector<std::string> cable_name;
  std::vector<double> cable_length, cable_rate, cable_tension;

  bool operator==(const StateTelemetry&) const = default;
};

struct ReducedStateTelemetry {
  static constexpr const char* kChannel = "MANTLE_REDUCED_STATE";

  std::int64_t utime{0};
  Triple root_position{};
  Quaternion root_quaternion{1, 0, 0, 0};
  std::vector<double> q, v;

  bool operator==(const ReducedStateTelemetry&) const = default;
};

struct PlanTelemetry {
  static constexpr const char* kChannel = "MANTLE_PLAN";

  std::int64_t utime{0};
  std::vector<double> time;                       ///< of the knots
  std::vector<std::vector<double>> tension;       ///< knots x motors
  std::vector<Triple> root_position;              ///< knots
  std::vector<std::vector<Triple>> tip_position;  ///< knots x arms
  double cost{0};
  std::string status;
  std::int64_t solve_time_us{0};

  bool operator==(const PlanTelemetry&) const = default;
};

struct DrivesTelemetry {
  static constexpr const char* kChannel = "MANTLE_DRIVES";

  std::int64_t utime{0};
  std::vector<std::string> motor_name;
  std::vector<std::int32_t> node, statusword;
  std::vector<std::int16_t> torque_permille;
  std::vector<std::int32_t> position_counts, velocity_counts_s;
  std::vector<std::int16_t> current_permille;
  std::vector<std::int8_t> temperature_celsius;
  std::vector<std::int16_t> target_torque_permille;
  std::vector<double> tension_estimate, reeled_length;

  bool operator==(const DrivesTelemetry&) const = default;
};

struct EnergyTelemetry {
  static constexpr const char* kChannel = "MANTLE_ENERGY";

  std::int64_t utime{0};
  double kinetic_solid{0}, kinetic_water{0}, elastic_arms{0}, elastic_mantle{0}, gravity{0};
  std::vector<std::string> work_name;
  std::vector<double> work;
  double dissipated{0}, input_power{0}, output_power{0};

  bool operator==(const EnergyTelemetry&) const = default;
};

struct StatusTelemetry {
  static constexpr const char* kChannel = "MANTLE_STATUS";

  std::int64_t utime{0};
  std::string control_mode, solver_status;
  std::int64_t solves{0}, iterations{0}, misses{0}, fallbacks{0}, safe_decays{0};
  std::string text;
  double rate{0};
  std::int64_t cycles{0}, late_cycles{0}, missed_cycles{0}, late_plans{0};
  std::vector<double> bin_begin;
  std::vector<std::int64_t> sync_lateness, command_time;  ///< bins

  bool operator==(const StatusTelemetry&) const = default;
};

struct ShapeTelemetry {
  static constexpr const char* kChannel = "MANTLE_SHAPE";

  std::int64_t utime{0};
  Triple root_position{};
  Quaternion root_quaternion{1, 0, 0, 0};
  std::vector<std::string> arm_name;
  std::vector<std::int32_t> arm_nodes;       ///< of this arm
  std::vector<double> arc_length;            ///< nodes: one arm after the other
  std::vector<Triple> position;              ///< nodes
  std::vector<Quaternion> quaternion;        ///< nodes
  std::vector<float> radius;                 ///< nodes
  std::vector<std::array<float, 6>> strain;  ///< spans: between a node and the next of its arm
  std::vector<std::array<float, 6>> stress;  ///< spans
  std::string mantle_name;                   ///< empty without a mantle
  double mantle_half_thickness{0};
  std::vector<double> mantle_arc_length;
  std::vector<Triple> mantle_profile;                ///< r, z, theta
  std::vector<std::array<float, 5>> mantle_strain;   ///< e11, e22, d11, d22, beta
  std::vector<std::array<float, 5>> mantle_stress;   ///< their conjugates
  std::vector<std::array<double, 2>> rigid_profile;  ///< r, z
  std::vector<std::string> cable_name;
  std::vector<std::int32_t> cable_points;  ///< of this cable
  std::vector<float> cable_tension;
  std::vector<std::array<float, 3>> cable_position;  ///< points: one cable after the other

  bool operator==(const ShapeTelemetry&) const = default;
};

struct ControlTelemetry {
  static constexpr const char* kChannel = "MANTLE_CONTROL";

  std::int64_t utime{0};
  std::vector<std::string> motor_name;
  std::vector<double> commanded_tension, actual_tension;
  std::string reference_kind;
  Triple reference{};
  double error{0};
  Triple root_position{};
  Quaternion root_quaternion{1, 0, 0, 0};
  std::vector<double> estimate_error;
  std::vector<double> deviation;  ///< empty, or one for each error

  bool operator==(const ControlTelemetry&) const = default;
};

struct WaterTelemetry {
  static constexpr const char* kChannel = "MANTLE_WATER";

  std::int64_t utime{0};
  Triple current{};
  std::vector<std::array<float, 3>> drag;  ///< nodes
  Triple body_drag{};

  bool operator==(const WaterTelemetry&) const = default;
};

struct SessionTelemetry {
  static constexpr const char* kChannel = "MANTLE_SESSION";

  std::int64_t utime{0};
  std::string scene, version, controller, bus;
  std::int8_t real_time{0};
  double duration{0}, body_length{0};
  std::string goal;
  std::vector<Triple> waypoint;
  double tolerance{0};
  std::string host;
  std::int32_t process{0};
  std::string results;

  bool operator==(const SessionTelemetry&) const = default;
};

struct SensorsTelemetry {
  static constexpr const char* kChannel = "MANTLE_SENSORS";

  std::int64_t utime{0};
  double time{0};
  std::int8_t held{0}, has_state{0};
  double state_time{0};
  Triple root_position{};
  Quaternion root_quaternion{1, 0, 0, 0};
  std::vector<double> q, v;
  std::vector<double> cable_length, cable_rate;
  std::vector<std::int32_t> instrument;
  std::vector<double> measured_time;
  std::vector<std::int32_t> measured_size;
  std::vector<std::array<double, 6>> measured;

  bool operator==(const SensorsTelemetry&) const = default;
};

struct CommandTelemetry {
  static constexpr const char* kChannel = "MANTLE_COMMAND";

  std::int64_t utime{0};
  double time_out{0};
  std::vector<double> tension;

  bool operator==(const CommandTelemetry&) const = default;
};

struct CycleTelemetry {
  static constexpr const char* kChannel = "MANTLE_CYCLE";

  std::int64_t utime{0};
  std::string phase;
  std::int64_t go_time{INT64_MAX};
  std::string host;
  std::int32_t process{0};

  bool operator==(const CycleTelemetry&) const = default;
};

struct StepTelemetry {
  static constexpr const char* kChannel = "MANTLE_STEP";

  std::int64_t utime{0}, number{0}, run{0};
  std::int8_t action{0};
  std::int64_t now{0}, frames_sent{0};

  bool operator==(const StepTelemetry&) const = default;
};

struct SteppedTelemetry {
  static constexpr const char* kChannel = "MANTLE_STEPPED";

  std::int64_t utime{0}, number{0}, run{0};
  std::int8_t ok{1};
  std::string reason;
  std::int8_t braked{0};
  std::int64_t frames_sent{0};

  bool operator==(const SteppedTelemetry&) const = default;
};

/// Where telemetry goes: the seam between a run and whoever listens.
class TelemetrySink {
 public:
  virtual ~TelemetrySink() = default;
  virtual void Write(const StateTelemetry& message) = 0;
  virtual void Write(const ReducedStateTelemetry& message) = 0;
  virtual void Write(const PlanTelemetry& message) = 0;
  virtual void Write(const DrivesTelemetry& message) = 0;
  virtual void Write(const EnergyTelemetry& message) = 0;
  virtual void Write(const StatusTelemetry& message) = 0;
  virtual void Write(const ShapeTelemetry& message) = 0;
  virtual void Write(const ControlTelemetry& message) = 0;
  virtual void Write(const WaterTelemetry& message) = 0;
  virtual void Write(const SessionTelemetry& message) = 0;
  // Between the programs of a loop: not all who listen to a run have a use for them.
  virtual void Write(const SensorsTelemetry&) {}
  virtual void Write(const CommandTelemetry&) {}
  virtual void Write(const CycleTelemetry&) {}
  virtual void Write(const StepTelemetry&) {}
  virtual void Write(const SteppedTelemetry&) {}
};

}  // namespace mantle::tools
