#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <string_view>

#include "model/robot_schema.h"

namespace mantle::model {
namespace {

using schema::kAnyValue;
using schema::Key;
using schema::kOneOrMore;
using schema::kPositive;
using schema::Optional;
using schema::Quantity;
using schema::Range;
using schema::Required;
using schema::Visitor;

// Steps align with break points, of which a shorter wave would have more than any run can take.
constexpr Range kPeriod{1e-6};

void DemandAscending(Visitor& v, std::string_view key, const std::vector<double>& t) {
  for (std::size_t i = 1; i < t.size(); ++i) {
    v.Demand(t[i] >= t[i - 1], key,
             fmt::format("must ascend; entry {} is {} s after {} s", i, t[i], t[i - 1]));
  }
}

void Describe(Visitor& v, Quantity quantity, Range range, TriangularSchedule& s) {
  v.Number({.name = "low", .meaning = "value at `start`", .unit = "value"}, quantity, range,
           &s.low);
  v.Number(Required({.name = "high", .meaning = "value half a period later", .unit = "value"}),
           quantity, range, &s.high);
  v.Number(Required({"period"}), Quantity::kTime, kPositive, &s.period_s);
  v.Number({"start", "constant before"}, Quantity::kTime, kAnyValue, &s.start_s);
}

void Describe(Visitor& v, Quantity quantity, SineSchedule& s) {
  v.Number(Required({.name = "amplitude",
                     .meaning = "offset + amplitude sin(2 pi frequency (t - start) + phase)",
                     .unit = "value"}),
           quantity, kAnyValue, &s.amplitude);
  v.Number(Required({"frequency"}), Quantity::kFrequency, kPositive, &s.frequency_hz);
  v.Number({"phase"}, Quantity::kAngle, kAnyValue, &s.phase_rad);
  v.Number({.name = "offset", .unit = "value"}, quantity, kAnyValue, &s.offset);
  v.Number({"start", "constant before"}, Quantity::kTime, kAnyValue, &s.start_s);
}

void Describe(Visitor& v, Quantity quantity, Range range, IntervalSchedule& s) {
  v.Number({.name = "value", .unit = "value"}, quantity, range, &s.value);
  v.Numbers(Required({.name = "on",
                      .meaning = "starts; the value holds in [on, off), zero outside",
                      .bound = "ascending"}),
            Quantity::kTime, kAnyValue, kOneOrMore, &s.on_s);
  v.Numbers(Required({.name = "off", .meaning = "ends", .bound = "> `on`, no overlap"}),
            Quantity::kTime, kAnyValue,
            v.describing() ? kOneOrMore : static_cast<int>(s.on_s.size()), &s.off_s);
  if (v.describing()) return;
  for (std::size_t i = 0; i < s.on_s.size(); ++i) {
    v.Demand(s.on_s[i] < s.off_s[i], "off",
             fmt::format("entry {} = {} s: must be > on = {} s", i, s.off_s[i], s.on_s[i]));
    v.Demand(i == 0 || s.on_s[i] >= s.off_s[i - 1], "on",
             fmt::format("entry {} = {} s: must be >= the end of the interval before, {} s", i,
                         s.on_s[i], i == 0 ? 0.0 : s.off_s[i - 1]));
  }
}

// Two columns, time [s] and value [SI], comma-separated; lines that start with a letter or # are
// titles.
void ReadColumns(Visitor& v, std::string_view text, TableSchedule* s) {
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t length = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, length);
    text.remove_prefix(std::min(length + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty() || line[0] == '#' || std::isalpha(static_cast<unsigned char>(line[0])))
      continue;
    double time = 0, value = 0;
    const char* end = line.data() + line.size();
    const auto first = std::from_chars(line.data(), end, time);
    const char* next = first.ptr;
    while (next < end && (*next == ',' || *next == ' ')) ++next;
    const auto second = std::from_chars(next, end, value);
    v.Demand(first.ec == std::errc() && second.ec == std::errc() && std::isfinite(time) &&
                 std::isfinite(value),
             "file",
             fmt::format("line {}: \"{}\": must be two finite numbers, time,value", number,
                         line.substr(0, 80)));
    s->time_s.push_back(time);
    s->value.push_back(value);
  }
  v.Demand(!s->time_s.empty(), "file", "holds no numbers");
  DemandAscending(v, "file", s->time_s);
}

void Describe(Visitor& v, Quantity quantity, Range range, TableSchedule& s) {
  const auto text = v.File(Optional(
      {.name = "file",
       .meaning = "CSV beside the scene, columns time [s], value [SI], lines of letters or # "
                  "skipped",
       .bound = "instead of `time` and `value`"}));
  if (text) {
    for (const auto* key : {"time", "value"}) {
      v.Demand(!v.Has(key), key, "must be absent where `file` is given");
    }
    ReadColumns(v, *text, &s);
    return;
  }
  const auto presence = v.describing() ? schema::Presence::kOptional : schema::Presence::kRequired;
  v.Numbers({.name = "time",
             .meaning = "linear between, constant outside",
             .bound = "ascending; two equal make a jump",
             .presence = presence},
            Quantity::kTime, kAnyValue, kOneOrMore, &s.time_s);
  v.Numbers({.name = "value", .meaning = "one per time", .unit = "value", .presence = presence},
            quantity, range, v.describing() ? kOneOrMore : static_cast<int>(s.time_s.size()),
            &s.value);
  DemandAscending(v, "time", s.time_s);
}

void Describe(Visitor& v, Quantity quantity, Range range, CubicSchedule& s) {
  v.Numbers(Required({.name = "time", .meaning = "of the values", .bound = "ascending"}),
            Quantity::kTime, kAnyValue, kOneOrMore, &s.time_s);
  v.Numbers(Required({.name = "value",
                      .meaning = "one per time; smooth between, never beyond neighbouring values, "
                                 "at rest where they turn and at both ends, constant outside",
                      .unit = "value"}),
            quantity, range, v.describing() ? kOneOrMore : static_cast<int>(s.time_s.size()),
            &s.value);
  for (std::size_t i = 1; i < s.time_s.size(); ++i) {
    v.Demand(s.time_s[i] > s.time_s[i - 1], "time",
             fmt::format("must ascend; entry {} is {} s after {} s", i, s.time_s[i],
                         s.time_s[i - 1]));
  }
}

void Describe(Visitor& v, Quantity quantity, Range range, PulseSchedule& s) {
  v.Number({.name = "low", .meaning = "value between pulses and before `start`", .unit = "value"},
           quantity, range, &s.low);
  v.Number(Required({.name = "high", .meaning = "value of the pulse", .unit = "value"}), quantity,
           range, &s.high);
  v.Number(Required({"period"}), Quantity::kTime, kPeriod, &s.period_s);
  v.Number({"rise", "time from `low` to `high`; 0: a jump"}, Quantity::kTime, schema::kNonNegative,
           &s.rise_s);
  v.Number({"hold", "time at `high`"}, Quantity::kTime, schema::kNonNegative, &s.hold_s);
  v.Number({.name = "fall",
            .meaning = "time back to `low`; 0: a jump",
            .also = "0 < `rise` + `hold` + `fall` <= `period`"},
           Quantity::kTime, schema::kNonNegative, &s.fall_s);
  v.Number({"start", "of the first pulse"}, Quantity::kTime, kAnyValue, &s.start_s);
  v.Choice<bool>({"edge", "of rise and fall: without kinks in the value, or straight"},
                 {{"smooth", true}, {"straight", false}}, &s.smooth);
  const double sum = s.rise_s + s.hold_s + s.fall_s;
  v.Demand(v.describing() || (sum > 0.0 && sum <= s.period_s * (1 + 1e-12)), "period",
           fmt::format("{} s: must be at least rise + hold + fall = {} s, which must be > 0",
                       s.period_s, sum));
}

void DescribeTable(Visitor& v, Quantity quantity, Range range, Schedule* schedule) {
  enum { kTriangular, kSine, kIntervals, kTable, kCubic, kPulse };
  int type = -1;
  v.Cases(Required({"type"}), {"triangular", "sine", "intervals", "table", "cubic", "pulse"}, &type,
          [&](int which) {
    switch (which) {
      case kTriangular:
        Describe(v, quantity, range, schedule->emplace<TriangularSchedule>());
        break;
      case kSine:
        Describe(v, quantity, schedule->emplace<SineSchedule>());
        break;
      case kIntervals:
        Describe(v, quantity, range, schedule->emplace<IntervalSchedule>());
        break;
      case kCubic:
        Describe(v, quantity, range, schedule->emplace<CubicSchedule>());
        break;
      case kPulse:
        Describe(v, quantity, range, schedule->emplace<PulseSchedule>());
        break;
      default:
        Describe(v, quantity, range, schedule->emplace<TableSchedule>());
    }
  });
}

}  // namespace

bool DescribeSchedule(Visitor& v, const Key& key, Quantity quantity, Range range,
                      Schedule* schedule) {
  bool given = false;
  Key table = key;
  table.type = "schedule";
  v.Either(
      table, schema::Form::kTable,
      [&] {
        Schedule read;
        given = v.Table(table, [&](Visitor& t) { DescribeTable(t, quantity, range, &read); });
        if (given) *schedule = read;
      },
      [&] {
        ConstantSchedule constant;
        if (const auto* before = std::get_if<ConstantSchedule>(schedule)) constant = *before;
        given = v.Number(key, quantity, range, &constant.value);
        if (given) *schedule = constant;
      });
  return given;
}

bool DescribeSchedule(Visitor& v, const Key& key, Quantity quantity, Range range,
                      std::optional<Schedule>* schedule) {
  Schedule read;
  if (!DescribeSchedule(v, Optional(key), quantity, range, &read)) return false;
  *schedule = read;
  return true;
}

void Describe(Visitor& v, CableDrive& drive) {
  v.OneOf(
      "a cable", false,
      {{"tension",
        [&] {
          GivenTension given;
          DescribeSchedule(v, Required({"tension", "given tension"}), Quantity::kForce,
                           schema::kNonNegative, &given.tension_n);
          drive = given;
        }},
       {"reel", [&] {
          ReeledLength reel;
          v.Table({.name = "reel", .meaning = "reeled length", .type = "reel"}, [&](Visitor& t) {
            DescribeSchedule(t,
                             Required({"length_change",
                                       "reel minus the cable's length at rest; negative pulls"}),
                             Quantity::kLength, kAnyValue, &reel.length_change_m);
            t.Number(Required({"stiffness",
                               "tension max(0, k (l - reel) + d (rates)), inside the "
                               "implicit step"}),
                     Quantity::kStiffness, kPositive, &reel.stiffness_n_m);
            t.Number({"damping"}, Quantity::kDamping, schema::kNonNegative, &reel.damping_n_s_m);
          });
          drive = reel;
        }}});
}

}  // namespace mantle::model
