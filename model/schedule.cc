#include "model/schedule.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mantle::model {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// Break points closer than this to the given time count as that time: a step that ends on a
// break point may miss it by round-off.
constexpr double kSameTime_s = 1e-12;

bool Reached(double t, double knot, bool from_left) {
  return from_left ? t > knot + kSameTime_s : t >= knot - kSameTime_s;
}

// Half-period index and position within it, in [0, 1].
struct HalfPeriod {
  double index, fraction;
};
HalfPeriod Locate(const TriangularSchedule& s, double t, bool from_left) {
  const double x = (t - s.start_s) / (0.5 * s.period_s);
  const double eps = kSameTime_s / (0.5 * s.period_s);
  const double index = from_left ? std::ceil(x - eps) - 1.0 : std::floor(x + eps);
  return {index, std::clamp(x - index, 0.0, 1.0)};
}

double ValueOf(const ConstantSchedule& s, double, bool) { return s.value; }
double ValueOf(const TriangularSchedule& s, double t, bool from_left) {
  if (t <= s.start_s) return s.low;
  const HalfPeriod h = Locate(s, t, from_left);
  const bool rising = std::fmod(h.index, 2.0) == 0.0;
  return s.low + (s.high - s.low) * (rising ? h.fraction : 1.0 - h.fraction);
}
double ValueOf(const SineSchedule& s, double t, bool) {
  const double x = std::max(t - s.start_s, 0.0);
  return s.offset +
         s.amplitude * std::sin(2.0 * std::numbers::pi * s.frequency_hz * x + s.phase_rad);
}
double ValueOf(const IntervalSchedule& s, double t, bool from_left) {
  for (std::size_t i = 0; i < s.on_s.size(); ++i) {
    if (Reached(t, s.on_s[i], from_left) && !Reached(t, s.off_s[i], from_left)) return s.value;
  }
  return 0.0;
}
// Index of the interval [time[i], time[i+1]) that holds t; -1 before the first, size-1 after the
// last.
int Locate(const TableSchedule& s, double t, bool from_left) {
  int i = -1;
  for (std::size_t k = 0; k < s.time_s.size() && Reached(t, s.time_s[k], from_left); ++k) {
    i = static_cast<int>(k);
  }
  return i;
}
double ValueOf(const TableSchedule& s, double t, bool from_left) {
  const int i = Locate(s, t, from_left);
  if (i < 0) return s.value.front();
  if (i + 1 >= static_cast<int>(s.value.size())) return s.value.back();
  const double f = (t - s.time_s[i]) / (s.time_s[i + 1] - s.time_s[i]);
  return s.value[i] + std::clamp(f, 0.0, 1.0) * (s.value[i + 1] - s.value[i]);
}

double RateOf(const ConstantSchedule&, double, bool) { return 0.0; }
double RateOf(const TriangularSchedule& s, double t, bool from_left) {
  if (!Reached(t, s.start_s, from_left)) return 0.0;
  const bool rising = std::fmod(Locate(s, t, from_left).index, 2.0) == 0.0;
  return (rising ? 2.0 : -2.0) * (s.high - s.low) / s.period_s;
}
double RateOf(const SineSchedule& s, double t, bool from_left) {
  if (!Reached(t, s.start_s, from_left)) return 0.0;
  const double w = 2.0 * std::numbers::pi * s.frequency_hz;
  return s.amplitude * w * std::cos(w * (t - s.start_s) + s.phase_rad);
}
double RateOf(const IntervalSchedule&, double, bool) { return 0.0; }
double RateOf(const TableSchedule& s, double t, bool from_left) {
  const int i = Locate(s, t, from_left);
  if (i < 0 || i + 1 >= static_cast<int>(s.value.size())) return 0.0;
  return (s.value[i + 1] - s.value[i]) / (s.time_s[i + 1] - s.time_s[i]);
}

double SecondRateOf(const SineSchedule& s, double t, bool from_left) {
  if (!Reached(t, s.start_s, from_left)) return 0.0;
  const double w = 2.0 * std::numbers::pi * s.frequency_hz;
  return -s.amplitude * w * w * std::sin(w * (t - s.start_s) + s.phase_rad);
}
template <typename PiecewiseLinear>
double SecondRateOf(const PiecewiseLinear&, double, bool) {
  return 0.0;
}

double Earliest(const std::vector<double>& times, double t, double best) {
  for (double x : times) {
    if (x > t + kSameTime_s) best = std::min(best, x);
  }
  return best;
}
double NextOf(const ConstantSchedule&, double) { return kNever; }
double NextOf(const TriangularSchedule& s, double t) {
  if (t + kSameTime_s < s.start_s) return s.start_s;
  const double half = 0.5 * s.period_s;
  return s.start_s + half * (std::floor((t - s.start_s) / half + kSameTime_s / half) + 1.0);
}
double NextOf(const SineSchedule& s, double t) {
  return t + kSameTime_s < s.start_s ? s.start_s : kNever;
}
double NextOf(const IntervalSchedule& s, double t) {
  return Earliest(s.off_s, t, Earliest(s.on_s, t, kNever));
}
double NextOf(const TableSchedule& s, double t) { return Earliest(s.time_s, t, kNever); }

std::optional<ScheduleJump> JumpOf(const ConstantSchedule&) { return {}; }
std::optional<ScheduleJump> JumpOf(const TriangularSchedule&) { return {}; }
std::optional<ScheduleJump> JumpOf(const SineSchedule&) { return {}; }
std::optional<ScheduleJump> JumpOf(const IntervalSchedule& s) {
  for (double t = NextOf(s, 0.0); t < kNever; t = NextOf(s, t)) {
    const double size = ValueOf(s, t, false) - ValueOf(s, t, true);
    if (size != 0.0) return ScheduleJump{t, size};
  }
  return {};
}
std::optional<ScheduleJump> JumpOf(const TableSchedule& s) {
  for (std::size_t i = 1; i < s.time_s.size(); ++i) {
    const bool jumps = s.time_s[i] == s.time_s[i - 1] && s.value[i] != s.value[i - 1];
    if (jumps && s.time_s[i] > 0.0) return ScheduleJump{s.time_s[i], s.value[i] - s.value[i - 1]};
  }
  return {};
}

}  // namespace

double Value(const Schedule& schedule, double t_s, bool from_left) {
  return std::visit([&](const auto& s) { return ValueOf(s, t_s, from_left); }, schedule);
}

double Rate(const Schedule& schedule, double t_s, bool from_left) {
  return std::visit([&](const auto& s) { return RateOf(s, t_s, from_left); }, schedule);
}

double SecondRate(const Schedule& schedule, double t_s, bool from_left) {
  return std::visit([&](const auto& s) { return SecondRateOf(s, t_s, from_left); }, schedule);
}

double NextBreakpoint(const Schedule& schedule, double t_s) {
  return std::visit([&](const auto& s) { return NextOf(s, t_s); }, schedule);
}

bool IsConstant(const Schedule& schedule) {
  return std::holds_alternative<ConstantSchedule>(schedule);
}

std::optional<ScheduleJump> FirstJump(const Schedule& schedule) {
  return std::visit([](const auto& s) { return JumpOf(s); }, schedule);
}

}  // namespace mantle::model
