#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include "firmware_sim/bus_load.h"
#include "firmware_sim/candump_log.h"
#include "firmware_sim/log_player.h"
#include "firmware_sim/open_bus.h"
#include "firmware_sim/socket_time.h"
#include "firmware_sim/traffic.h"
#include "tools/mantle/commands.h"

/// `mantle bus`: what is on a bus, in words and in per cent of its capacity.

namespace mantle::tools {

namespace {

using namespace firmware_sim;
using Json = nlohmann::ordered_json;

constexpr std::int64_t kSecond_us = 1'000'000;
constexpr std::int64_t kWaitSlice_us = 100'000;

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void OnInterrupt(int) { interrupted = true; }

void CatchInterrupts() {
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
}

struct MonitorOptions {
  std::string bus;
  double duration_s{0};
  bool json{false};
  bool changes{false};
  std::string record;
};

struct LoadOptions {
  CyclicTraffic traffic{};
  int pdos{4};
  double period_ms{10};
  double heartbeat_ms{100};
  bool json{false};
};

struct PlayOptions {
  std::string file;
  std::string bus;
  double speed{1.0};
};

// Runs `body`, turns what it throws for bad input into one line and status 2.
template <typename Body>
int Guard(std::string_view command, const Body& body) {
  try {
    return body();
  } catch (const std::invalid_argument& error) {
    std::cerr << "mantle bus " << command << ": " << error.what() << "\n";
  } catch (const std::system_error& error) {
    std::cerr << "mantle bus " << command << ": " << error.what() << "\n";
  }
  return kExitBadInput;
}

Json ToJson(const CanFrame& frame, const DecodedFrame& decoded) {
  std::string data;
  for (int i = 0; i < frame.size && !frame.remote; ++i) {
    data += fmt::format("{:02X}", frame.data[i]);
  }
  Json json{{"type", "frame"},
            {"time_us", frame.time_us},
            {"id", frame.extended ? fmt::format("0x{:08X}", frame.id)
                                  : fmt::format("0x{:03X}", frame.id)},
            {"data", data},
            {"service", std::string(decoded.service)},
            {"node", decoded.node}};
  for (const TrafficField& field : decoded.fields) {
    std::visit([&](const auto& value) { json[std::string(field.name)] = value; }, field.value);
  }
  return json;
}

// The monitor's running sums: since the start, and since the last line about the load.
class Monitor {
 public:
  explicit Monitor(const MonitorOptions& options) : options_(options) {}

  void Show(const CanFrame& frame) {
    const DecodedFrame decoded = Decode(frame);
    frames_ += 1;
    interval_frames_ += 1;
    const int bits = ActualFrameBits(frame);
    bits_ += bits;
    interval_bits_ += bits;
    ++frames_of_[std::string(decoded.service)];
    if (first_us_ == 0) first_us_ = frame.time_us;
    if (options_.changes && !Changed(frame, decoded)) return;
    if (options_.json) {
      std::cout << ToJson(frame, decoded).dump() << "\n";
    } else {
      std::cout << fmt::format("{:12.6f}  ", static_cast<double>(frame.time_us - first_us_) * 1e-6)
                << Describe(frame) << "\n";
    }
  }

  void ShowLoad(std::int64_t interval_us) {
    const double percent = LoadPercent(interval_bits_, interval_us);
    most_percent_ = std::max(most_percent_, percent);
    if (options_.json) {
      std::cout << Json{{"type", "load"},
                        {"frames", interval_frames_},
                        {"percent", percent},
                        {"warn", percent > kBusLoadWarningPercent}}
                       .dump()
                << std::endl;
    } else {
      std::cout << fmt::format("-- {} frames, bus load {:.1f} % of 1 Mbit/s{}", interval_frames_,
                               percent, Warning(percent))
                << std::endl;
    }
    interval_frames_ = 0;
    interval_bits_ = 0;
  }

  void ShowSummary(std::int64_t elapsed_us, const BusCounters& counters) const {
    const double percent = LoadPercent(bits_, elapsed_us);
    if (options_.json) {
      std::cout << Json{{"type", "summary"},
                        {"seconds", static_cast<double>(elapsed_us) * 1e-6},
                        {"frames", frames_},
                        {"services", frames_of_},
                        {"percent", percent},
                        {"receive_dropped", counters.receive_dropped},
                        {"malformed", counters.malformed},
                        {"error_frames", counters.error_frames},
                        {"recoveries", counters.recoveries}}
                       .dump()
                << std::endl;
      return;
    }
    std::cout << fmt::format("== {:.1f} s, {} frames, bus load {:.1f} % of 1 Mbit/s{}\n",
                             static_cast<double>(elapsed_us) * 1e-6, frames_, percent,
                             Warning(percent));
    for (const auto& [service, count] : frames_of_) {
      std::cout << fmt::format("   {:<12} {}\n", service, count);
    }
    if (counters.receive_dropped > 0 || counters.malformed > 0 || counters.recoveries > 0) {
      std::cout << fmt::format("   lost before we read them {}, malformed {}, link recoveries {}\n",
                               counters.receive_dropped, counters.malformed, counters.recoveries);
    }
    std::cout << std::flush;
  }

 private:
  static std::string_view Warning(double percent) {
    return percent > kBusLoadWarningPercent ? " (WARNING: above 70 %)" : "";
  }

  // Whether the frame says something else than the last one of its identifier.
  bool Changed(const CanFrame& frame, const DecodedFrame& decoded) {
    if (decoded.service == "SYNC") return false;
    const std::string said = decoded.fields.empty() ? Describe(frame) : decoded.text;
    auto [last, is_new] = last_.try_emplace(frame.id, said);
    if (!is_new && last->second == said) return false;
    last->second = said;
    return true;
  }

  MonitorOptions options_;
  std::uint64_t frames_{0};
  std::uint64_t interval_frames_{0};
  double bits_{0};
  double interval_bits_{0};
  double most_percent_{0};
  std::int64_t first_us_{0};
  std::map<std::string, std::uint64_t> frames_of_;
  std::map<std::uint32_t, std::string> last_;
};

int RunMonitor(const MonitorOptions& options) {
  if (options.duration_s < 0) {
    throw std::invalid_argument(
        fmt::format("--duration is {} s, must be 0 or more", options.duration_s));
  }
  const auto bus = OpenBus(options.bus);
  std::optional<CandumpWriter> log;
  if (!options.record.empty()) {
    log.emplace(options.record, options.bus.starts_with("can:") ? options.bus.substr(4) : "vcan0");
  }
  CatchInterrupts();
  Monitor monitor(options);
  const std::int64_t begin_us = MonotonicTime_us();
  const auto duration_us = static_cast<std::int64_t>(options.duration_s * 1e6);
  std::int64_t interval_begin_us = begin_us;
  std::int64_t now_us = begin_us;
  std::array<CanFrame, 256> batch;
  while (!interrupted && (duration_us == 0 || now_us - begin_us < duration_us)) {
    const std::int64_t left_us = duration_us == 0
                                     ? kWaitSlice_us
                                     : std::min(kWaitSlice_us, duration_us - (now_us - begin_us));
    bus->Wait(left_us);
    const std::size_t count = bus->Receive(batch);
    for (std::size_t i = 0; i < count; ++i) {
      if (log) log->Write(batch[i]);
      monitor.Show(batch[i]);
    }
    if (count > 0 && count < batch.size()) std::cout << std::flush;
    now_us = MonotonicTime_us();
    if (now_us - interval_begin_us >= kSecond_us) {
      monitor.ShowLoad(now_us - interval_begin_us);
      interval_begin_us = now_us;
    }
  }
  monitor.ShowSummary(now_us - begin_us, bus->counters());
  if (log && !log->Flush()) {
    std::cerr << "mantle bus monitor: log file '" << options.record << "': not all was written\n";
    return 1;
  }
  return 0;
}

int RunLoad(LoadOptions options) {
  if (options.pdos != 2 && options.pdos != 4) {
    throw std::invalid_argument(fmt::format(
        "--pdos is {}, must be 4 (RPDO1, RPDO2, TPDO1, TPDO2) or 2 (RPDO1, TPDO1)", options.pdos));
  }
  if (!(options.period_ms > 0 && options.period_ms <= 10'000)) {
    throw std::invalid_argument(
        fmt::format("--period-ms is {}, must be 0.1 to 10000", options.period_ms));
  }
  if (!(options.heartbeat_ms >= 0 && options.heartbeat_ms <= 65'535)) {
    throw std::invalid_argument(
        fmt::format("--heartbeat-ms is {}, must be 0 to 65535", options.heartbeat_ms));
  }
  options.traffic.rpdos = options.traffic.tpdos = options.pdos / 2;
  options.traffic.period_us = std::llround(options.period_ms * 1000);
  options.traffic.heartbeat_us = std::llround(options.heartbeat_ms * 1000);
  const BusLoad load = LoadOfScene(options.traffic);
  if (options.json) {
    Json rows = Json::array();
    for (const LoadRow& row : load.rows) {
      rows.push_back({{"frame", row.frame},
                      {"cob_id", row.cob_id},
                      {"bytes", row.size},
                      {"per_cycle", row.count},
                      {"worst_bits", row.worst_bits}});
    }
    std::cout << Json{{"rows", rows},
                      {"frames", load.frames},
                      {"least_bits", load.least_bits},
                      {"worst_bits", load.worst_bits},
                      {"least_percent", load.least_percent},
                      {"worst_percent", load.worst_percent},
                      {"warn", load.warn}}
                     .dump(2)
              << "\n";
    return 0;
  }
  std::cout << fmt::format("{:<10} {:<22} {:>5} {:>9} {:>11} {:>12}\n", "frame", "COB-ID", "bytes",
                           "per cycle", "bits, worst", "bits a cycle");
  for (const LoadRow& row : load.rows) {
    std::cout << fmt::format("{:<10} {:<22} {:>5} {:>9.6g} {:>11} {:>12.1f}\n", row.frame,
                             row.cob_id, row.size, row.count, row.worst_bits,
                             row.count * row.worst_bits);
  }
  std::cout << fmt::format(
      "{} drives every {} ms: {:.6g} frames, {:.0f} to {:.0f} bits a cycle (without and with the "
      "most stuff bits)\nbus load {:.1f} to {:.1f} % of 1 Mbit/s\n",
      options.traffic.drives, options.period_ms, load.frames, load.least_bits, load.worst_bits,
      load.least_percent, load.worst_percent);
  if (load.worst_percent > 100) {
    std::cout << "WARNING: does not fit on the bus in the worst case\n";
  } else if (load.warn) {
    std::cout << "WARNING: above 70 %: late frames, and no room for SDO and EMCY\n";
  }
  return 0;
}

int RunPlay(const PlayOptions& options) {
  std::ifstream in(options.file);
  if (!in) throw std::invalid_argument(fmt::format("log file '{}' cannot be read", options.file));
  CandumpLog log;
  try {
    log = ReadCandumpLog(in);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("log file '{}', {}", options.file, error.what()));
  }
  const auto bus = OpenBus(options.bus);
  CatchInterrupts();
  LogPlayer player(std::move(log.frames), MonotonicTime_us(), options.speed);
  std::uint64_t sent = 0;
  while (!player.done() && !interrupted) {
    const std::int64_t now_us = MonotonicTime_us();
    sent += player.Play(now_us, *bus);
    if (!player.done()) {
      SleepFor(std::clamp<std::int64_t>(player.next_due_us() - now_us, 0, kWaitSlice_us));
    }
  }
  std::cout << fmt::format("{} frames sent, {} refused by the bus, {} CAN FD frames skipped\n",
                           sent, player.refused(), log.skipped);
  return player.refused() == 0 ? 0 : kExitCannotContinue;
}

void AddMonitor(CLI::App& bus, int& exit_status) {
  auto options = std::make_shared<MonitorOptions>();
  CLI::App* command = bus.add_subcommand(
      "monitor",
      "Prints what is on a bus, decoded by the profile of the drives (docs/bus.md): NMT, SYNC, "
      "EMCY with its meaning, SDO with object names and abort reasons, PDOs with the drive's state "
      "in words, torque in per cent of rated, position in counts; once a second the bus load in "
      "per cent of 1 Mbit/s.\n"
      "  mantle bus monitor --bus can:vcan0 --changes\n"
      "  mantle bus monitor --bus udp:239.74.163.2:43113 --duration 10 --json\n"
      "  mantle bus monitor --bus can:vcan0 --record run.log   # then: canplayer -I run.log");
  command->add_option("--bus", options->bus, std::string(kSharedBusSpecHelp))->required();
  command->add_option("--duration", options->duration_s,
                      "seconds to listen; 0 (default): until interrupted");
  command->add_flag("--changes", options->changes,
                    "print a frame only where it says something else than the last of its "
                    "identifier; SYNC never");
  command->add_flag("--json", options->json, "one JSON object a line: frame, load, summary");
  command->add_option("--record", options->record,
                      "write every frame to this file, in candump's log format");
  command->callback([options, &exit_status] {
    exit_status = Guard("monitor", [&] { return RunMonitor(*options); });
  });
}

void AddLoad(CLI::App& bus, int& exit_status) {
  auto options = std::make_shared<LoadOptions>();
  CLI::App* command = bus.add_subcommand(
      "load",
      "The bus load of N drives by count: each frame of a cycle with its bits, least and worst "
      "case of stuff bits, in per cent of 1 Mbit/s; warns above 70 %.\n"
      "  mantle bus load --nodes 8 --period-ms 10");
  command->add_option("--nodes", options->traffic.drives, "number of drives, 1 to 126 (default 8)");
  command->add_option("--period-ms", options->period_ms, "SYNC period (default 10)");
  command->add_option("--pdos", options->pdos, "PDOs of each drive: 4 (default) or 2");
  command->add_option("--heartbeat-ms", options->heartbeat_ms,
                      "heartbeat period of every node (default 100; 0: leave them out)");
  command->add_flag("--json", options->json, "one JSON object");
  command->callback(
      [options, &exit_status] { exit_status = Guard("load", [&] { return RunLoad(*options); }); });
}

void AddPlay(CLI::App& bus, int& exit_status) {
  auto options = std::make_shared<PlayOptions>();
  CLI::App* command = bus.add_subcommand("play",
                                         "Replays a candump log on a bus with its timing.\n"
                                         "  mantle bus play run.log --bus udp:239.74.163.2:43113");
  command->add_option("file", options->file, "log of `candump -l` or of --record")->required();
  command->add_option("--bus", options->bus, std::string(kSharedBusSpecHelp))->required();
  command->add_option("--speed", options->speed, "2 plays twice as fast (default 1)");
  command->callback(
      [options, &exit_status] { exit_status = Guard("play", [&] { return RunPlay(*options); }); });
}

}  // namespace

void AddBusCommand(CLI::App& app, int& exit_status) {
  CLI::App* bus = app.add_subcommand("bus", "Watches a CAN bus, counts its load, replays logs");
  bus->require_subcommand(1);
  AddMonitor(*bus, exit_status);
  AddLoad(*bus, exit_status);
  AddPlay(*bus, exit_status);
}

}  // namespace mantle::tools
