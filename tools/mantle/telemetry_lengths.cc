#include "tools/mantle/telemetry_lengths.h"

namespace mantle::tools {
namespace {

constexpr std::uint64_t kDouble = 8, kInt64 = 8, kFloat = 4, kInt32 = 4;

/// Walks over an encoded message; once something does not fit, nothing does.
class WireWalk {
 public:
  explicit WireWalk(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  /// `count` values of `unit` bytes.
  void Skip(std::uint64_t count, std::uint64_t unit) {
    if (!fits_ || count > left_.size() / unit) {
      fits_ = false;
      return;
    }
    left_ = left_.subspan(static_cast<std::size_t>(count * unit));
  }

  /// A count that lists are sized by; 0 where it is none.
  std::uint64_t Count() {
    const std::uint32_t count = Number();
    if (count > INT32_MAX) fits_ = false;
    return fits_ ? count : 0;
  }

  void Text() {
    const std::uint32_t size = Number();
    if (size == 0 || size > left_.size() || left_[size - 1] != 0) fits_ = false;
    Skip(size, 1);
  }

  void Texts(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count && fits_; ++i) Text();
  }

  bool AtEnd() const { return fits_ && left_.empty(); }

 private:
  std::uint32_t Number() {
    constexpr std::size_t kSize = 4;
    if (!fits_ || left_.size() < kSize) {
      fits_ = false;
      return 0;
    }
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < kSize; ++i) value = value << 8 | left_[i];
    left_ = left_.subspan(kSize);
    return value;
  }

  std::span<const std::uint8_t> left_;
  bool fits_{true};
};

}  // namespace

template <>
bool LengthsFit<StateTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);           // utime
  walk.Skip(3 + 4 + 6, kDouble);  // root
  const std::uint64_t arms = walk.Count();
  walk.Texts(arms);
  walk.Skip(arms, (3 + 4 + 6) * kDouble);  // tips
  walk.Skip(3 + 3 + 3, kDouble);           // centre_of_mass, heading, volume, its rate, thrust
  const std::uint64_t cables = walk.Count();
  walk.Texts(cables);
  walk.Skip(cables, 3 * kDouble);  // length, rate, tension
  return walk.AtEnd();
}

template <>
bool LengthsFit<ReducedStateTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);       // utime
  walk.Skip(3 + 4, kDouble);  // root
  walk.Skip(walk.Count(), kDouble);
  walk.Skip(walk.Count(), kDouble);
  return walk.AtEnd();
}

template <>
bool LengthsFit<PlanTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);  // utime
  const std::uint64_t knots = walk.Count(), motors = walk.Count(), arms = walk.Count();
  walk.Skip(knots, kDouble);           // time
  walk.Skip(knots * motors, kDouble);  // tension; counts are below 2^31
  walk.Skip(knots, 3 * kDouble);       // root_position
  walk.Skip(knots * arms, 3 * kDouble);
  walk.Skip(1, kDouble);  // cost
  walk.Text();            // status
  walk.Skip(1, kInt64);   // solve_time_us
  return walk.AtEnd();
}

template <>
bool LengthsFit<DrivesTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);  // utime
  const std::uint64_t drives = walk.Count();
  walk.Texts(drives);
  constexpr std::uint64_t kRow =
      4 + 4 + 2 + 4 + 4 + 2 + 1 + 2 + 2 * kDouble;  // node to reeled_length
  walk.Skip(drives, kRow);
  return walk.AtEnd();
}

template <>
bool LengthsFit<EnergyTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);  // utime
  walk.Skip(5, kDouble);
  const std::uint64_t works = walk.Count();
  walk.Texts(works);
  walk.Skip(works, kDouble);
  walk.Skip(3, kDouble);
  return walk.AtEnd();
}

template <>
bool LengthsFit<StatusTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);  // utime
  walk.Text();           // control_mode
  walk.Text();           // solver_status
  walk.Skip(5, kInt64);  // solves to safe_decays
  walk.Text();
  walk.Skip(1, kDouble);                               // rate
  walk.Skip(4, kInt64);                                // cycles to late_plans
  walk.Skip(walk.Count(), kDouble + kInt64 + kInt64);  // bins
  return walk.AtEnd();
}

template <>
bool LengthsFit<ShapeTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);       // utime
  walk.Skip(3 + 4, kDouble);  // root
  const std::uint64_t arms = walk.Count(), nodes = walk.Count(), spans = walk.Count();
  walk.Texts(arms);
  walk.Skip(arms, kInt32);                           // arm_nodes
  walk.Skip(nodes, (1 + 3 + 4) * kDouble + kFloat);  // arc_length to radius
  walk.Skip(spans, (6 + 6) * kFloat);                // strain, stress
  walk.Text();                                       // mantle_name
  walk.Skip(1, kDouble);                             // mantle_half_thickness
  const std::uint64_t mantle_nodes = walk.Count(), mantle_spans = walk.Count();
  walk.Skip(mantle_nodes, (1 + 3) * kDouble);
  walk.Skip(mantle_spans, (5 + 5) * kFloat);
  walk.Skip(walk.Count(), 2 * kDouble);  // rigid_profile
  const std::uint64_t cables = walk.Count(), points = walk.Count();
  walk.Texts(cables);
  walk.Skip(cables, kInt32 + kFloat);  // cable_points, cable_tension
  walk.Skip(points, 3 * kFloat);       // cable_position
  return walk.AtEnd();
}

template <>
bool LengthsFit<ControlTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);  // utime
  const std::uint64_t motors = walk.Count();
  walk.Texts(motors);
  walk.Skip(motors, 2 * kDouble);  // tensions
  walk.Text();                     // reference_kind
  walk.Skip(3 + 1, kDouble);       // reference, error
  walk.Skip(3 + 4, kDouble);       // root
  walk.Skip(walk.Count(), kDouble);
  walk.Skip(walk.Count(), kDouble);
  return walk.AtEnd();
}

template <>
bool LengthsFit<WaterTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);   // utime
  walk.Skip(3, kDouble);  // current
  walk.Skip(walk.Count(), 3 * kFloat);
  walk.Skip(3, kDouble);  // body_drag
  return walk.AtEnd();
}

template <>
bool LengthsFit<SessionTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);   // utime
  walk.Texts(4);          // scene to bus
  walk.Skip(1, 1);        // real_time
  walk.Skip(2, kDouble);  // duration, body_length
  walk.Text();            // goal
  walk.Skip(walk.Count(), 3 * kDouble);
  walk.Skip(1, kDouble);  // tolerance
  walk.Text();            // host
  walk.Skip(1, kInt32);   // process
  walk.Text();            // results
  return walk.AtEnd();
}

template <>
bool LengthsFit<SensorsTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);                  // utime
  walk.Skip(1, kDouble);                 // time
  walk.Skip(2, 1);                       // held, has_state
  walk.Skip(1 + 3 + 4, kDouble);         // state_time, root
  walk.Skip(walk.Count(), kDouble);      // q
  walk.Skip(walk.Count(), kDouble);      // v
  walk.Skip(walk.Count(), 2 * kDouble);  // cables
  walk.Skip(walk.Count(), kInt32 + kDouble + kInt32 + 6 * kDouble);
  return walk.AtEnd();
}

template <>
bool LengthsFit<CommandTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);   // utime
  walk.Skip(1, kDouble);  // time_out
  walk.Skip(walk.Count(), kDouble);
  return walk.AtEnd();
}

template <>
bool LengthsFit<CycleTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(1, kInt64);  // utime
  walk.Text();           // phase
  walk.Skip(1, kInt64);  // go_time
  walk.Text();           // host
  walk.Skip(1, kInt32);  // process
  return walk.AtEnd();
}

template <>
bool LengthsFit<StepTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(3, kInt64);  // utime, number, run
  walk.Skip(1, 1);       // action
  walk.Skip(2, kInt64);  // now, frames_sent
  return walk.AtEnd();
}

template <>
bool LengthsFit<SteppedTelemetry>(std::span<const std::uint8_t> bytes) {
  WireWalk walk(bytes);
  walk.Skip(3, kInt64);  // utime, number, run
  walk.Skip(1, 1);       // ok
  walk.Text();           // reason
  walk.Skip(1, 1);       // braked
  walk.Skip(1, kInt64);  // frames_sent
  return walk.AtEnd();
}

}  // namespace mantle::tools
