#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "tools/mantle/commands.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"
#include "tools/mantle/telemetry_fields.h"

/// `mantle log`: what is in an event log, and one channel of it as a table.

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Say what is in an LCM event log: channels, counts, rates, time span; print one channel as a "
    "table.\n\n"
    "  mantle log results/telemetry.lcmlog\n"
    "  mantle log results/telemetry.lcmlog --channel MANTLE_PLAN --csv > plan.csv\n\n"
    "Reads any LCM log; decodes the channels of docs/telemetry.md. Exit status 2: no log, or no "
    "message of\n"
    "the channel that can be read. 3: the log is cut\n"
    "short or damaged; what stands before that is printed.";

struct LogOptions {
  std::string file;
  std::string channel;
  bool csv{false};
  bool json{false};
};

struct ChannelCount {
  std::int64_t messages{0}, bytes{0}, first_us{0}, last_us{0};

  void Add(const LogEvent& event) {
    first_us = messages == 0 ? event.time_us : std::min(first_us, event.time_us);
    last_us = messages == 0 ? event.time_us : std::max(last_us, event.time_us);
    ++messages;
    bytes += static_cast<std::int64_t>(event.bytes.size());
  }
  double span_s() const { return 1e-6 * static_cast<double>(last_us - first_us); }
  double rate_hz() const {
    return last_us > first_us ? static_cast<double>(messages - 1) / span_s() : 0.0;
  }
};

/// Prints messages of one channel as rows: a column for each number or text, the fields' names
/// with their indices ("tip_position_0_2"). Messages of another shape than the first are refused.
class CsvPrinter final : public TelemetrySink {
 public:
  void Write(const StateTelemetry& m) override { Print(m); }
  void Write(const ReducedStateTelemetry& m) override { Print(m); }
  void Write(const PlanTelemetry& m) override { Print(m); }
  void Write(const DrivesTelemetry& m) override { Print(m); }
  void Write(const EnergyTelemetry& m) override { Print(m); }
  void Write(const StatusTelemetry& m) override { Print(m); }
  void Write(const ShapeTelemetry& m) override { Print(m); }
  void Write(const ControlTelemetry& m) override { Print(m); }
  void Write(const WaterTelemetry& m) override { Print(m); }
  void Write(const SessionTelemetry& m) override { Print(m); }
  void Write(const SensorsTelemetry& m) override { Print(m); }
  void Write(const CommandTelemetry& m) override { Print(m); }
  void Write(const CycleTelemetry& m) override { Print(m); }
  void Write(const StepTelemetry& m) override { Print(m); }
  void Write(const SteppedTelemetry& m) override { Print(m); }

 private:
  template <typename T>
  void Add(const std::string& name, const T& value) {
    if constexpr (std::is_same_v<T, std::string>) {
      AddCell(name, Quoted(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
      AddCell(name, fmt::format("{}", value));
    } else {
      for (std::size_t i = 0; i < value.size(); ++i) Add(fmt::format("{}_{}", name, i), value[i]);
    }
  }

  void AddCell(const std::string& name, const std::string& text) {
    const char* comma = row_.empty() ? "" : ",";
    titles_ += comma + name;
    row_ += comma + text;
  }

  static std::string Quoted(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + "\"";
  }

  template <typename Message>
  void Print(const Message& message) {
    titles_.clear();
    row_.clear();
    VisitFields([&](const char* name, const auto& field) { Add(name, field); }, message);
    if (first_titles_.empty()) {
      first_titles_ = titles_;
      PrintText(titles_ + "\n");
    }
    if (titles_ != first_titles_) {
      throw BadInput(
          fmt::format("{} at utime {}: has other lists than the first message, must be "
                      "one robot and one horizon in a table",
                      Message::kChannel, message.utime));
    }
    PrintText(row_ + "\n");
  }

  std::string first_titles_, titles_, row_;
};

int PrintTable(const LogOptions& options) {
  CsvPrinter printer;
  std::int64_t rows = 0, malformed = 0;
  const char* why = "";
  const LogEnd end = ReadEventLog(options.file, [&](const LogEvent& event) {
    if (event.channel != options.channel) return;
    ++(DecodeTelemetry(event.channel, event.bytes, printer, &why) ? rows : malformed);
  });
  if (rows == 0 && malformed > 0) {
    throw BadInput(fmt::format("{}: {} of {} messages of {} are not of its type: {}", options.file,
                               malformed, malformed, options.channel, why));
  }
  if (rows == 0 && !end.damaged_at_byte) {
    throw BadInput(
        fmt::format("--channel: {}: no message of ours in {}; `mantle log {}` lists the channels",
                    options.channel, options.file, options.file));
  }
  std::string wrong;
  if (malformed > 0) {
    wrong = fmt::format("{} of {} messages of {} are not of its type: {}", malformed,
                        rows + malformed, options.channel, why);
  }
  if (end.damaged_at_byte) {
    wrong += fmt::format("{}cut short or damaged after event {} (byte {})",
                         wrong.empty() ? "" : "; ", end.events, *end.damaged_at_byte);
  }
  if (!wrong.empty()) Complain("{}: {}", options.file, wrong);
  return malformed == 0 && !end.damaged_at_byte ? 0 : kExitCannotContinue;
}

int PrintCounts(const LogOptions& options) {
  std::map<std::string, ChannelCount> channels;
  ChannelCount all;
  const LogEnd end = ReadEventLog(options.file, [&](const LogEvent& event) {
    if (!options.channel.empty() && event.channel != options.channel) return;
    channels[std::string(event.channel)].Add(event);
    all.Add(event);
  });
  if (options.json) {
    Json j{{"file", options.file},
           {"events", end.events},
           {"span_s", all.span_s()},
           {"damaged_at_byte", end.damaged_at_byte ? Json(*end.damaged_at_byte) : Json()},
           {"channels", Json::object()}};
    for (const auto& [name, c] : channels) {
      j["channels"][name] = {{"messages", c.messages},
                             {"bytes", c.bytes},
                             {"first_us", c.first_us},
                             {"last_us", c.last_us},
                             {"rate_hz", c.rate_hz()}};
    }
    PrintText(Dump(j));
  } else {
    Print("{}: {} messages in {:.6g} s\n", options.file, all.messages, all.span_s());
    Print("{:<24} {:>9} {:>10} {:>12} {:>12} {:>12}\n", "channel", "messages", "rate, Hz",
          "mean, bytes", "from, s", "to, s");
    for (const auto& [name, c] : channels) {
      Print("{:<24} {:>9} {:>10.4g} {:>12.0f} {:>12.3f} {:>12.3f}\n", name, c.messages, c.rate_hz(),
            static_cast<double>(c.bytes) / static_cast<double>(c.messages),
            1e-6 * static_cast<double>(c.first_us), 1e-6 * static_cast<double>(c.last_us));
    }
  }
  if (!end.damaged_at_byte) return 0;
  Complain("{}: cut short or damaged after event {} (byte {})", options.file, end.events,
           *end.damaged_at_byte);
  return kExitCannotContinue;
}

}  // namespace

void AddLogCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("log", kHelp);
  static LogOptions options;  // lives as long as the parser that points to it
  command->add_option("FILE", options.file, "Event log")->required();
  CLI::Option* channel = command->add_option("--channel", options.channel, "This channel alone");
  CLI::Option* csv = command->add_flag("--csv", options.csv, "Its messages, a row for each");
  csv->needs(channel);
  command->add_flag("--json", options.json, "One JSON object")->excludes(csv);
  command->callback(
      [&exit_status] { exit_status = options.csv ? PrintTable(options) : PrintCounts(options); });
}

}  // namespace mantle::tools
