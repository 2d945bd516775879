#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include "firmware_sim/bus/bus_load.h"
#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/log_player.h"
#include "firmware_sim/bus/open_bus.h"
#include "firmware_sim/bus/socket_time.h"
#include "loop/scene/regular_file.h"
#include "tools/mantle/bus_monitor.h"
#include "tools/mantle/commands.h"
#include "tools/mantle/standard_output.h"

/// `mantle bus`: what is on a bus, in words and in per cent of its capacity.

namespace mantle::tools {

namespace {

using namespace firmware_sim;
using Json = nlohmann::ordered_json;

constexpr std::int64_t kWaitSlice_us = 100'000;

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void OnInterrupt(int) { interrupted = true; }

void CatchInterrupts() {
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
}

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
    ComplainText(error.what(), fmt::format("mantle bus {}", command));
  } catch (const std::system_error& error) {
    ComplainText(error.what(), fmt::format("mantle bus {}", command));
  }
  return kExitBadInput;
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
    PrintText(Json{{"rows", rows},
                   {"frames", load.frames},
                   {"least_bits", load.least_bits},
                   {"worst_bits", load.worst_bits},
                   {"least_percent", load.least_percent},
                   {"worst_percent", load.worst_percent},
                   {"warn", load.warn}}
                  .dump(2) +
              "\n");
    return 0;
  }
  Print("{:<10} {:<22} {:>5} {:>9} {:>11} {:>12}\n", "frame", "COB-ID", "bytes", "per cycle",
        "bits, worst", "bits a cycle");
  for (const LoadRow& row : load.rows) {
    Print("{:<10} {:<22} {:>5} {:>9.6g} {:>11} {:>12.1f}\n", row.frame, row.cob_id, row.size,
          row.count, row.worst_bits, row.count * row.worst_bits);
  }
  Print(
      "{} drives every {} ms: {:.6g} frames, {:.0f} to {:.0f} bits a cycle (without and with the "
      "most stuff bits)\nbus load {:.1f} to {:.1f} % of 1 Mbit/s\n",
      options.traffic.drives, options.period_ms, load.frames, load.least_bits, load.worst_bits,
      load.least_percent, load.worst_percent);
  if (load.worst_percent > 100) {
    PrintText("WARNING: does not fit on the bus in the worst case\n");
  } else if (load.warn) {
    PrintText("WARNING: above 70 %: late frames, and no room for SDO and EMCY\n");
  }
  return 0;
}

int RunPlay(const PlayOptions& options) {
  constexpr std::uintmax_t kMostBytes = 256 << 20;
  std::istringstream in;
  try {
    in.str(scene::ReadRegularFile(options.file, kMostBytes));
  } catch (const scene::UnreadableFile& error) {
    throw std::invalid_argument(
        fmt::format("log file '{}' cannot be read: {}", options.file, error.what()));
  }
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
  Print("{} frames sent, {} refused by the bus, {} CAN FD frames skipped\n", sent, player.refused(),
        log.skipped);
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
    exit_status = Guard("monitor", [&] {
      CatchInterrupts();
      return RunMonitor(*options, interrupted);
    });
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
