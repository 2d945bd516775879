#pragma once

#include <fmt/format.h>

#include <string>
#include <type_traits>
#include <vector>

#include "tools/mantle/telemetry.h"
#include "tools/mantle/telemetry_fields.h"

/// Messages of an eight-armed vehicle in which every leaf has a value of its own, and a sink that
/// keeps what it gets.

namespace mantle::testing_tools {

inline constexpr std::size_t kArms = 8;
inline constexpr std::size_t kCables = 33;  ///< four in each arm, and the mantle's
inline constexpr std::size_t kMotors = 16;
inline constexpr std::size_t kKnots = 21;  ///< of a horizon of 20 intervals
inline constexpr std::size_t kCoordinates = 8 * 12 + 3;
inline constexpr std::size_t kWorks = 60;
inline constexpr std::size_t kNodes = 8 * 11, kMantleNodes = 33, kRigidPoints = 3;
inline constexpr std::size_t kWaypoints = 5;
inline constexpr std::size_t kBins = 82;  // of a histogram
inline constexpr std::size_t kCablePoints = 32 * 11 + 16;
inline constexpr std::int64_t kSamplePeriod_us = 10'000;

/// Leaf n (counted over the message, utime is leaf 0) of sample k: k + n / 8 as a double, (k + n)
/// mod 100 as an integer, "k.n" as a text. All of them exact; lcm_log_test.py knows the same rule.
class LeafFiller {
 public:
  explicit LeafFiller(int sample) : sample_(sample) {}

  template <typename T>
  void operator()(const char*, T& field) {
    Fill(field);
  }

 private:
  template <typename T>
  void Fill(T& value) {
    if constexpr (std::is_same_v<T, std::string>) {
      value = fmt::format("{}.{}", sample_, leaf_++);
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<T>((sample_ + leaf_++) % 100);
    } else if constexpr (std::is_floating_point_v<T>) {
      value = static_cast<T>(sample_ + leaf_++ / 8.0);
    } else {
      for (auto& entry : value) Fill(entry);
    }
  }

  int sample_, leaf_{0};
};

template <typename Message>
void Fill(int sample, Message* message) {
  tools::VisitFields(LeafFiller(sample), *message);
  message->utime = sample * kSamplePeriod_us;
}

struct Messages {
  tools::StateTelemetry state;
  tools::ReducedStateTelemetry reduced_state;
  tools::PlanTelemetry plan;
  tools::DrivesTelemetry drives;
  tools::EnergyTelemetry energy;
  tools::StatusTelemetry status;
  tools::ShapeTelemetry shape;
  tools::ControlTelemetry control;
  tools::WaterTelemetry water;
  tools::SessionTelemetry session;

  bool operator==(const Messages&) const = default;
  void WriteTo(tools::TelemetrySink& sink) const {
    sink.Write(state);
    sink.Write(reduced_state);
    sink.Write(plan);
    sink.Write(drives);
    sink.Write(energy);
    sink.Write(status);
    sink.Write(shape);
    sink.Write(control);
    sink.Write(water);
    sink.Write(session);
  }
};

inline Messages OctopusMessages(int sample) {
  Messages m;
  m.state.arm_name.resize(kArms);
  m.state.tip_position.resize(kArms);
  m.state.tip_quaternion.resize(kArms);
  m.state.tip_twist.resize(kArms);
  m.state.cable_name.resize(kCables);
  for (auto* list : {&m.state.cable_length, &m.state.cable_rate, &m.state.cable_tension}) {
    list->resize(kCables);
  }
  m.reduced_state.q.resize(kCoordinates);
  m.reduced_state.v.resize(6 + kCoordinates);
  m.plan.time.resize(kKnots);
  m.plan.tension.assign(kKnots, std::vector<double>(kMotors));
  m.plan.root_position.resize(kKnots);
  m.plan.tip_position.assign(kKnots, std::vector<tools::Triple>(kArms));
  tools::DrivesTelemetry& d = m.drives;
  d.motor_name.resize(kMotors);
  for (auto* list : {&d.node, &d.statusword, &d.position_counts, &d.velocity_counts_s}) {
    list->resize(kMotors);
  }
  for (auto* list : {&d.torque_permille, &d.current_permille, &d.target_torque_permille}) {
    list->resize(kMotors);
  }
  d.temperature_celsius.resize(kMotors);
  d.tension_estimate.resize(kMotors);
  d.reeled_length.resize(kMotors);
  m.energy.work_name.resize(kWorks);
  m.energy.work.resize(kWorks);
  m.status.bin_begin.resize(kBins);
  m.status.sync_lateness.resize(kBins);
  m.status.command_time.resize(kBins);
  tools::ShapeTelemetry& s = m.shape;
  s.arm_name.resize(kArms);
  s.arm_nodes.resize(kArms);
  s.arc_length.resize(kNodes);
  s.position.resize(kNodes);
  s.quaternion.resize(kNodes);
  s.radius.resize(kNodes);
  s.strain.resize(kNodes - kArms);
  s.stress.resize(kNodes - kArms);
  s.mantle_arc_length.resize(kMantleNodes);
  s.mantle_profile.resize(kMantleNodes);
  s.mantle_strain.resize(kMantleNodes - 1);
  s.mantle_stress.resize(kMantleNodes - 1);
  s.rigid_profile.resize(kRigidPoints);
  s.cable_name.resize(kCables);
  s.cable_points.resize(kCables);
  s.cable_tension.resize(kCables);
  s.cable_position.resize(kCablePoints);
  for (auto* list : {&m.control.commanded_tension, &m.control.actual_tension}) {
    list->resize(kMotors);
  }
  m.control.motor_name.resize(kMotors);
  m.control.estimate_error.resize(2 * (6 + kCoordinates));
  m.control.deviation.resize(2 * (6 + kCoordinates));
  m.water.drag.resize(kNodes);
  m.session.waypoint.resize(kWaypoints);
  Fill(sample, &m.state);
  Fill(sample, &m.reduced_state);
  Fill(sample, &m.plan);
  Fill(sample, &m.drives);
  Fill(sample, &m.energy);
  Fill(sample, &m.status);
  Fill(sample, &m.shape);
  Fill(sample, &m.control);
  Fill(sample, &m.water);
  Fill(sample, &m.session);
  return m;
}

/// Keeps the last message of each type and counts all.
class Recorder final : public tools::TelemetrySink {
 public:
  void Write(const tools::StateTelemetry& m) override { Keep(m, &last.state); }
  void Write(const tools::ReducedStateTelemetry& m) override { Keep(m, &last.reduced_state); }
  void Write(const tools::PlanTelemetry& m) override { Keep(m, &last.plan); }
  void Write(const tools::DrivesTelemetry& m) override { Keep(m, &last.drives); }
  void Write(const tools::EnergyTelemetry& m) override { Keep(m, &last.energy); }
  void Write(const tools::StatusTelemetry& m) override { Keep(m, &last.status); }
  void Write(const tools::ShapeTelemetry& m) override { Keep(m, &last.shape); }
  void Write(const tools::ControlTelemetry& m) override { Keep(m, &last.control); }
  void Write(const tools::WaterTelemetry& m) override { Keep(m, &last.water); }
  void Write(const tools::SessionTelemetry& m) override { Keep(m, &last.session); }

  Messages last;
  int count{0};

 private:
  template <typename Message>
  void Keep(const Message& message, Message* kept) {
    *kept = message;
    ++count;
  }
};

}  // namespace mantle::testing_tools
