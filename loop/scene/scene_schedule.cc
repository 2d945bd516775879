#include <fmt/format.h>

#include <charconv>
#include <numbers>
#include <sstream>

#include "loop/scene/regular_file.h"
#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

void DemandAscending(TomlReader* table, std::string_view key, const std::vector<double>& t,
                     bool strictly) {
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] < t[i - 1] || (strictly && t[i] == t[i - 1])) {
      table->Fail(key, fmt::format("must ascend; entry {} is {} s after {} s", i, t[i], t[i - 1]));
    }
  }
}

IntervalSchedule ReadIntervals(TomlReader* table, Quantity quantity, Range range) {
  IntervalSchedule s;
  s.value = table->Number("value", quantity, range, 1.0);
  s.on_s = table->Numbers("on", Quantity::kTime, kAnyValue);
  s.off_s = table->Numbers("off", Quantity::kTime, kAnyValue, static_cast<int>(s.on_s.size()));
  for (std::size_t i = 0; i < s.on_s.size(); ++i) {
    if (!(s.on_s[i] < s.off_s[i])) {
      table->Fail("off",
                  fmt::format("entry {} = {} s: must be > on = {} s", i, s.off_s[i], s.on_s[i]));
    }
    if (i > 0 && s.on_s[i] < s.off_s[i - 1]) {
      table->Fail("on",
                  fmt::format("entry {} = {} s: must be >= the end of the interval before, {} s", i,
                              s.on_s[i], s.off_s[i - 1]));
    }
  }
  return s;
}

// Two columns, time [s] and value [SI], comma-separated; lines that start with a letter or # are
// titles.
void ReadTableFile(TomlReader* table, const std::string& file, TableSchedule* s) {
  constexpr std::uintmax_t kMostBytes = 64 << 20;
  std::istringstream in;
  try {
    const std::string text = ReadRegularFile(table->context().directory / file, kMostBytes);
    table->context().files_hash = Hash(text, table->context().files_hash);
    in.str(text);
  } catch (const UnreadableFile& error) {
    table->Fail("file", fmt::format("cannot be read: {}", error.what()));
  }
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line[0] == '#' || std::isalpha(static_cast<unsigned char>(line[0])))
      continue;
    double t = 0, v = 0;
    const char* end = line.data() + line.size();
    const auto first = std::from_chars(line.data(), end, t);
    const char* next = first.ptr;
    while (next < end && (*next == ',' || *next == ' ')) ++next;
    const auto second = std::from_chars(next, end, v);
    if (first.ec != std::errc() || second.ec != std::errc() || !std::isfinite(t) ||
        !std::isfinite(v)) {
      table->Fail("file", fmt::format("line {}: \"{}\": must be two finite numbers, time,value",
                                      number, line));
    }
    s->time_s.push_back(t);
    s->value.push_back(v);
  }
  if (s->time_s.empty()) table->Fail("file", "holds no numbers");
  DemandAscending(table, "file", s->time_s, false);
}

TableSchedule ReadTable(TomlReader* table, Quantity quantity, Range range) {
  TableSchedule s;
  const std::string file = table->Text("file", "");
  if (!file.empty()) {
    for (const auto* key : {"time", "value"}) {
      if (table->Has(key)) table->Fail(key, "must be absent where `file` is given");
    }
    ReadTableFile(table, file, &s);
    return s;
  }
  s.time_s = table->Numbers("time", Quantity::kTime, kAnyValue);
  s.value = table->Numbers("value", quantity, range, static_cast<int>(s.time_s.size()));
  DemandAscending(table, "time", s.time_s, false);
  return s;
}

Schedule ReadScheduleTable(TomlReader table, Quantity quantity, Range range) {
  enum class Type { kNone, kTriangular, kSine, kIntervals, kTable };
  const Type type = table.Choice<Type>("type",
                                       {{"triangular", Type::kTriangular},
                                        {"sine", Type::kSine},
                                        {"intervals", Type::kIntervals},
                                        {"table", Type::kTable}},
                                       Type::kNone);
  Schedule out;
  switch (type) {
    case Type::kNone:
      table.Fail("type",
                 "is missing: must be one of \"triangular\", \"sine\", \"intervals\", \"table\"");
    case Type::kTriangular:
      out = TriangularSchedule{table.Number("low", quantity, range, 0.0),
                               table.Number("high", quantity, range),
                               table.Number("period", Quantity::kTime, kPositive),
                               table.Number("start", Quantity::kTime, kAnyValue, 0.0)};
      break;
    case Type::kSine:
      out = SineSchedule{table.Number("amplitude", quantity, kAnyValue),
                         table.Number("frequency", Quantity::kFrequency, kPositive),
                         table.Number("phase", Quantity::kAngle, kAnyValue, 0.0),
                         table.Number("offset", quantity, kAnyValue, 0.0),
                         table.Number("start", Quantity::kTime, kAnyValue, 0.0)};
      break;
    case Type::kIntervals:
      out = ReadIntervals(&table, quantity, range);
      break;
    case Type::kTable:
      out = ReadTable(&table, quantity, range);
      break;
  }
  table.Finish();
  return out;
}

}  // namespace

Schedule ReadSchedule(TomlReader* parent, std::string_view key, Quantity quantity, Range range) {
  const TomlValue* value = parent->Raw(key);
  if (value != nullptr && value->kind == TomlValue::Kind::kTable) {
    return ReadScheduleTable(*parent->OptionalTable(key, "schedule"), quantity, range);
  }
  return ConstantSchedule{parent->Number(key, quantity, range)};
}

std::optional<Schedule> ReadOptionalSchedule(TomlReader* parent, std::string_view key,
                                             Quantity quantity, Range range) {
  if (!parent->Has(key)) return std::nullopt;
  return ReadSchedule(parent, key, quantity, range);
}

CableDrive ReadCableDrive(TomlReader* cable) {
  const bool given = cable->Has("tension");
  auto reel = cable->OptionalTable("reel", "reel");
  if (given == reel.has_value()) {
    cable->Fail(given ? "reel" : "tension",
                "a cable must have exactly one of `tension` and `reel`");
  }
  if (given) return GivenTension{ReadSchedule(cable, "tension", Quantity::kForce, kNonNegative)};
  ReeledLength out;
  out.length_change_m = ReadSchedule(&*reel, "length_change", Quantity::kLength, kAnyValue);
  out.stiffness_n_m = reel->Number("stiffness", Quantity::kStiffness, kPositive);
  out.damping_n_s_m = reel->Number("damping", Quantity::kDamping, kNonNegative, 0.0);
  reel->Finish();
  return out;
}

}  // namespace mantle::scene
