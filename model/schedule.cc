#include "model/schedule.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace mantle::model {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// Break points closer than this to the time asked for count as that time: a step that ends on a
// break point may miss it by round-off.
constexpr double kSameTime_s = 1e-12;
// A difference of limits below this share of a pulse is no jump.
constexpr double kRoundOff = 1e-9;

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
int Locate(const std::vector<double>& time, double t, bool from_left) {
  int i = -1;
  for (std::size_t k = 0; k < time.size() && Reached(t, time[k], from_left); ++k) {
    i = static_cast<int>(k);
  }
  return i;
}
double ValueOf(const TableSchedule& s, double t, bool from_left) {
  const int i = Locate(s.time_s, t, from_left);
  if (i < 0) return s.value.front();
  if (i + 1 >= static_cast<int>(s.value.size())) return s.value.back();
  const double f = (t - s.time_s[i]) / (s.time_s[i + 1] - s.time_s[i]);
  return s.value[i] + std::clamp(f, 0.0, 1.0) * (s.value[i + 1] - s.value[i]);
}

// One interval of a CubicSchedule, y(u), u = (t - start) / length in [0, 1].
struct Cubic {
  double start, length, y0, y1, slope0, slope1;  // slopes times length

  double Value(double u) const {
    const double v = 1.0 - u;
    return y0 * v * v * (1.0 + 2.0 * u) + y1 * u * u * (3.0 - 2.0 * u) + slope0 * u * v * v -
           slope1 * u * u * v;
  }
  double Rate(double u) const {
    return (6.0 * u * (1.0 - u) * (y1 - y0) + slope0 * (1.0 - u) * (1.0 - 3.0 * u) +
            slope1 * u * (3.0 * u - 2.0)) /
           length;
  }
  double SecondRate(double u) const {
    return ((6.0 - 12.0 * u) * (y1 - y0) + slope0 * (6.0 * u - 4.0) + slope1 * (6.0 * u - 2.0)) /
           (length * length);
  }
  double Integral(double u) const {
    const double u2 = u * u, u3 = u2 * u, u4 = u2 * u2;
    return length * (y0 * (u - u3 + 0.5 * u4) + y1 * (u3 - 0.5 * u4) +
                     slope0 * (0.5 * u2 - 2.0 / 3.0 * u3 + 0.25 * u4) +
                     slope1 * (0.25 * u4 - u3 / 3.0));
  }
};

double SlopeAt(const CubicSchedule& s, int i) {
  const int last = static_cast<int>(s.time_s.size()) - 1;
  if (i == 0 || i == last) return 0.0;
  const double before = s.time_s[i] - s.time_s[i - 1], after = s.time_s[i + 1] - s.time_s[i];
  const double a = (s.value[i] - s.value[i - 1]) / before;
  const double b = (s.value[i + 1] - s.value[i]) / after;
  if (!(a * b > 0.0)) return 0.0;
  const double share = (before + 2.0 * after) / (3.0 * (before + after));
  return a * b / (share * b + (1.0 - share) * a);
}

Cubic IntervalOf(const CubicSchedule& s, int i) {
  const double length = s.time_s[i + 1] - s.time_s[i];
  return {s.time_s[i],          length, s.value[i], s.value[i + 1], length * SlopeAt(s, i),
          length * SlopeAt(s, i + 1)};
}

// Part of the interval that holds t, and where in it; nothing where the schedule is constant.
struct CubicPlace {
  Cubic cubic;
  double u;
};
std::optional<CubicPlace> PlaceOf(const CubicSchedule& s, double t, bool from_left) {
  const int i = Locate(s.time_s, t, from_left);
  if (i < 0 || i + 1 >= static_cast<int>(s.time_s.size())) return std::nullopt;
  const Cubic c = IntervalOf(s, i);
  return CubicPlace{c, std::clamp((t - c.start) / c.length, 0.0, 1.0)};
}
double ValueOf(const CubicSchedule& s, double t, bool from_left) {
  if (const auto place = PlaceOf(s, t, from_left)) return place->cubic.Value(place->u);
  return Locate(s.time_s, t, from_left) < 0 ? s.value.front() : s.value.back();
}

// Where in its period a pulse is: 0 rising, 1 high, 2 falling, 3 low; and how far through an edge.
struct PulsePlace {
  int part;
  double u;
};
std::array<double, 4> EdgesOf(const PulseSchedule& s) {
  return {0.0, s.rise_s, s.rise_s + s.hold_s, s.rise_s + s.hold_s + s.fall_s};
}
double PeriodOf(const PulseSchedule& s, double t, bool from_left) {
  const double x = (t - s.start_s) / s.period_s, eps = kSameTime_s / s.period_s;
  return from_left ? std::ceil(x - eps) - 1.0 : std::floor(x + eps);
}
PulsePlace PlaceOf(const PulseSchedule& s, double t, bool from_left) {
  if (!Reached(t, s.start_s, from_left)) return {3, 0.0};
  const double in_period = t - s.start_s - PeriodOf(s, t, from_left) * s.period_s;
  const std::array<double, 4> edge = EdgesOf(s);
  int part = 0;
  for (int k = 1; k < 4; ++k) {
    if (Reached(in_period, edge[k], from_left)) part = k;
  }
  const double length = part == 0 ? s.rise_s : s.fall_s;
  const double u = part % 2 == 0 && length > 0.0 ? (in_period - edge[part]) / length : 0.0;
  return {part, std::clamp(u, 0.0, 1.0)};
}
double Edge(const PulseSchedule& s, double u) { return s.smooth ? u * u * (3.0 - 2.0 * u) : u; }
double ValueOf(const PulseSchedule& s, double t, bool from_left) {
  const PulsePlace place = PlaceOf(s, t, from_left);
  const double share[] = {Edge(s, place.u), 1.0, 1.0 - Edge(s, place.u), 0.0};
  return s.low + share[place.part] * (s.high - s.low);
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
  const int i = Locate(s.time_s, t, from_left);
  if (i < 0 || i + 1 >= static_cast<int>(s.value.size())) return 0.0;
  return (s.value[i + 1] - s.value[i]) / (s.time_s[i + 1] - s.time_s[i]);
}
double RateOf(const CubicSchedule& s, double t, bool from_left) {
  const auto place = PlaceOf(s, t, from_left);
  return place ? place->cubic.Rate(place->u) : 0.0;
}
double RateOf(const PulseSchedule& s, double t, bool from_left) {
  const PulsePlace place = PlaceOf(s, t, from_left);
  if (place.part % 2 != 0) return 0.0;
  const double slope = s.smooth ? 6.0 * place.u * (1.0 - place.u) : 1.0;
  return (s.high - s.low) * slope * (place.part == 0 ? 1.0 / s.rise_s : -1.0 / s.fall_s);
}

double SecondRateOf(const CubicSchedule& s, double t, bool from_left) {
  const auto place = PlaceOf(s, t, from_left);
  return place ? place->cubic.SecondRate(place->u) : 0.0;
}
double SecondRateOf(const PulseSchedule& s, double t, bool from_left) {
  const PulsePlace place = PlaceOf(s, t, from_left);
  if (place.part % 2 != 0 || !s.smooth) return 0.0;
  const double length = place.part == 0 ? s.rise_s : -s.fall_s;
  return (s.high - s.low) * (6.0 - 12.0 * place.u) / (length * std::abs(length));
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
double NextOf(const CubicSchedule& s, double t) { return Earliest(s.time_s, t, kNever); }
double NextOf(const PulseSchedule& s, double t) {
  if (t + kSameTime_s < s.start_s) return s.start_s;
  const double from = s.start_s + PeriodOf(s, t, false) * s.period_s;
  double next = from + s.period_s;
  for (const double edge : EdgesOf(s)) {
    if (from + edge > t + kSameTime_s) next = std::min(next, from + edge);
  }
  return next > t ? next : next + s.period_s;
}

// Antiderivatives, each from a time of its own choice.
double PrimitiveOf(const ConstantSchedule& s, double t) { return s.value * t; }
double PrimitiveOf(const TriangularSchedule& s, double t) {
  if (t <= s.start_s) return s.low * (t - s.start_s);
  const double half = 0.5 * s.period_s;
  const double index = std::floor((t - s.start_s) / half);
  const double f = (t - s.start_s) / half - index;
  const bool rising = std::fmod(index, 2.0) == 0.0;
  const double ramp = 0.5 * f * f * (s.high - s.low);
  return half * (0.5 * index * (s.low + s.high) + (rising ? f * s.low + ramp : f * s.high - ramp));
}
double PrimitiveOf(const SineSchedule& s, double t) {
  const double x = t - s.start_s, w = 2.0 * std::numbers::pi * s.frequency_hz;
  if (x <= 0.0) return x * (s.offset + s.amplitude * std::sin(s.phase_rad));
  return s.offset * x + s.amplitude / w * (std::cos(s.phase_rad) - std::cos(w * x + s.phase_rad));
}
double PrimitiveOf(const IntervalSchedule& s, double t) {
  double sum = 0;
  for (std::size_t i = 0; i < s.on_s.size(); ++i) {
    sum += s.value * std::clamp(t - s.on_s[i], 0.0, s.off_s[i] - s.on_s[i]);
  }
  return sum;
}
template <typename Part>  // Part(i, t): integral of the i-th interval up to t
double PiecewisePrimitive(const std::vector<double>& time, const std::vector<double>& value,
                          double t, Part part) {
  if (t <= time.front()) return value.front() * (t - time.front());
  double sum = 0;
  for (std::size_t i = 0; i + 1 < time.size() && t > time[i]; ++i) {
    sum += part(static_cast<int>(i), std::min(t, time[i + 1]));
  }
  return sum + value.back() * std::max(t - time.back(), 0.0);
}
double PrimitiveOf(const TableSchedule& s, double t) {
  return PiecewisePrimitive(s.time_s, s.value, t, [&](int i, double to) {
    const double x = to - s.time_s[i], length = s.time_s[i + 1] - s.time_s[i];
    if (!(length > 0.0)) return 0.0;
    return x * (s.value[i] + 0.5 * x / length * (s.value[i + 1] - s.value[i]));
  });
}
double PrimitiveOf(const CubicSchedule& s, double t) {
  return PiecewisePrimitive(s.time_s, s.value, t, [&](int i, double to) {
    const Cubic c = IntervalOf(s, i);
    return c.Integral((to - c.start) / c.length);
  });
}
double PrimitiveOf(const PulseSchedule& s, double t) {
  const double x = t - s.start_s;
  if (x <= 0.0) return s.low * x;
  const double whole = std::floor(x / s.period_s), in_period = x - whole * s.period_s;
  const std::array<double, 4> edge = EdgesOf(s);
  const auto ramp = [&](double u) {  // of the edge's shape from 0 to u
    return s.smooth ? u * u * u * (1.0 - 0.5 * u) : 0.5 * u * u;
  };
  const auto share = [&](double from, double length) {
    return length > 0.0 ? std::clamp((in_period - from) / length, 0.0, 1.0) : 0.0;
  };
  const double rise = share(0.0, s.rise_s), fall = share(edge[2], s.fall_s);
  const double high = s.rise_s * ramp(rise) + std::clamp(in_period - edge[1], 0.0, s.hold_s) +
                      s.fall_s * (fall - ramp(fall));
  const double period = 0.5 * (s.rise_s + s.fall_s) + s.hold_s;
  return s.low * x + (s.high - s.low) * (whole * period + high);
}

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
std::optional<ScheduleJump> JumpOf(const CubicSchedule&) { return {}; }
std::optional<ScheduleJump> JumpOf(const PulseSchedule& s) {
  double t = 0.0;
  for (int i = 0; i < 8; ++i) {  // more than one period
    t = NextOf(s, t);
    const double size = ValueOf(s, t, false) - ValueOf(s, t, true);
    if (std::abs(size) > kRoundOff * std::abs(s.high - s.low)) return ScheduleJump{t, size};
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

double Integral(const Schedule& schedule, double t_s) {
  return std::visit([&](const auto& s) { return PrimitiveOf(s, t_s) - PrimitiveOf(s, 0.0); },
                    schedule);
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
