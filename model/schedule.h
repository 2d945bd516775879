#pragma once

#include <optional>
#include <variant>
#include <vector>

/// Scalar functions of time that drive loads, cables and prescribed motion. Their kinks and jumps
/// are reported as break points, with which every integrator aligns its steps ([physics.md] 7).

namespace mantle::model {

struct ConstantSchedule {
  double value{0};
};

/// Triangular wave: `low` at t = start, `high` half a period later; `low` before start.
struct TriangularSchedule {
  double low{0}, high{1}, period_s{1}, start_s{0};
};

/// offset + amplitude sin(2 pi frequency (t - start) + phase); `offset + amplitude sin(phase)`
/// before start.
struct SineSchedule {
  double amplitude{1}, frequency_hz{1}, phase_rad{0}, offset{0}, start_s{0};
};

/// `value` inside the intervals [on_s[i], off_s[i]), zero outside; intervals ascend, do not
/// overlap.
struct IntervalSchedule {
  double value{1};
  std::vector<double> on_s, off_s;
};

/// Piecewise linear through (time_s[i], value[i]), constant before the first and after the last.
/// Two equal times make a jump: the later value holds from that time on.
struct TableSchedule {
  std::vector<double> time_s, value;
};

/// Smooth through (time_s[i], value[i]), constant before the first and after the last: monotone
/// cubics (Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5, 1984), of slope zero at both ends and
/// wherever the values turn, so that nothing lies beyond the values. Times ascend strictly. The
/// rate is continuous; its own rate jumps at the times.
struct CubicSchedule {
  std::vector<double> time_s, value;
};

/// A periodic pulse: from `low` at start + n period up to `high` within rise_s, there for hold_s,
/// back within fall_s, `low` for the rest of the period and before start. Edges are straight, or
/// 3 x^2 - 2 x^3; one that takes no time is a jump. rise + hold + fall <= period.
struct PulseSchedule {
  double low{0}, high{1}, period_s{1}, rise_s{0}, hold_s{0}, fall_s{0}, start_s{0};
  bool smooth{true};
};

using Schedule = std::variant<ConstantSchedule, TriangularSchedule, SineSchedule, IntervalSchedule,
                              TableSchedule, CubicSchedule, PulseSchedule>;

/// Value at time `t_s`, right-continuous. `from_left` gives the limit from the left instead, which
/// is what the last stage of a step that ends on a jump has to see.
double Value(const Schedule& schedule, double t_s, bool from_left = false);

/// Right derivative with respect to time (left derivative with `from_left`).
double Rate(const Schedule& schedule, double t_s, bool from_left = false);

/// Second derivative, from the same side as Rate.
double SecondRate(const Schedule& schedule, double t_s, bool from_left = false);

/// Integral from time 0 to `t_s` (negative before).
double Integral(const Schedule& schedule, double t_s);

/// First break point later than `t_s`; infinity if there is none.
double NextBreakpoint(const Schedule& schedule, double t_s);

/// True if the value never changes.
bool IsConstant(const Schedule& schedule);

/// The first time after t = 0 at which the value itself jumps, and by how much.
struct ScheduleJump {
  double time_s, size;
};
std::optional<ScheduleJump> FirstJump(const Schedule& schedule);

}  // namespace mantle::model
