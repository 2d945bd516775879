#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "firmware_sim/bus/open_bus.h"
#include "firmware_sim/bus/socket_time.h"
#include "firmware_sim/canopen/eds.h"
#include "firmware_sim/drive/drive.h"
#include "tools/mantle/commands.h"
#include "tools/mantle/standard_output.h"

namespace mantle::tools {
namespace {

using namespace firmware_sim;

constexpr int kLastNode = kMaxNode - 1;
constexpr std::size_t kBatch = 64;
/// A bus in flood must not keep the drives from their watchdogs, nor us from a signal.
constexpr std::size_t kMostFramesATurn = 1024;
/// Longest sleep: the tick of the drives.
constexpr std::int64_t kSlice_us = kControlTick_us;

constexpr const char* kHelp =
    R"(Runs N winch drives (CANopen CiA 301, CiA 402) on a bus in real time, until SIGINT, SIGTERM or
--duration. Each hauls a spring-loaded dummy cable: 20 mm of slack, then 500 N/m.

Any CANopen client can talk to them. By hand, with can-utils and drive 1:
  mantle drives --bus can:vcan0 --nodes 8 &
  candump -td vcan0 &
  cansend vcan0 000#0100                  NMT: start all
  cansend vcan0 601#2B40600006000000      controlword 6040 = 0006: ready to switch on
  cansend vcan0 601#4041600000000000      read the statusword 6041
  cansend vcan0 601#2F01220002000000      break the encoder line (object 2201): EMCY 7320
  cansend vcan0 000#8101                  NMT: reset node 1
To enable, send RPDO1 and SYNC at least every 100 ms (object 1400:5), else the drive faults with
8250. `mantle drives --eds` prints the electronic data sheet for configuration tools.)";

volatile std::sig_atomic_t stop_requested = 0;

void RequestStop(int) { stop_requested = 1; }

struct Options {
  std::string bus;
  int nodes{8};
  int first_node{1};
  double duration_s{0.0};
  bool has_duration{false};
  bool json{false};
  bool eds{false};
};

void Check(const Options& options) {
  if (options.bus.empty()) {
    throw std::invalid_argument(fmt::format("--bus missing: {}", kBusSpecHelp));
  }
  if (options.first_node < 1 || options.first_node > kLastNode) {
    throw std::invalid_argument(fmt::format("--first-node {} outside 1..{} (127 is the master)",
                                            options.first_node, kLastNode));
  }
  const int most = kLastNode - options.first_node + 1;
  if (options.nodes < 1 || options.nodes > most) {
    throw std::invalid_argument(
        fmt::format("--nodes {} outside 1..{} drives (first node {}, last {})", options.nodes, most,
                    options.first_node, kLastNode));
  }
  // A comparison that NaN fails.
  if (options.has_duration && !(options.duration_s > 0.0 && options.duration_s <= 1e6)) {
    throw std::invalid_argument(
        fmt::format("--duration {} s outside 0..1000000 s", options.duration_s));
  }
}

class Runner {
 public:
  Runner(Bus& bus, const Options& options)
      : bus_(bus), to_output_(!options.json), start_us_(MonotonicTime_us()) {
    for (int i = 0; i < options.nodes; ++i) {
      DriveConfig config;
      config.node = static_cast<NodeId>(options.first_node + i);
      drives_.emplace_back(config, start_us_);
      states_.push_back(drives_.back().state());
    }
    if (options.has_duration) {
      end_us_ = start_us_ + static_cast<std::int64_t>(1e6 * options.duration_s);
    }
  }

  void Run() {
    Flush();
    while (stop_requested == 0 && (end_us_ == 0 || MonotonicTime_us() < end_us_)) {
      bus_.Wait(kSlice_us);
      TakeFrames();
      const std::int64_t now_us = MonotonicTime_us();
      for (Drive& drive : drives_) drive.AdvanceTo(now_us);
      Flush();
      ReportChanges();
    }
  }

  nlohmann::json Status() const {
    const BusCounters counters = bus_.counters();
    nlohmann::json drives = nlohmann::json::array();
    for (const Drive& drive : drives_) {
      const ObjectDictionary& objects = drive.objects();
      drives.push_back({{"node", drive.objects().node()},
                        {"state", Name(drive.state())},
                        {"nmt", Name(drive.nmt_state())},
                        {"statusword", objects.Number(Slot(object::kStatusword))},
                        {"error_code", objects.Number(Slot(object::kErrorCode))},
                        {"position_counts", objects.Number(Slot(object::kPositionActual))},
                        {"torque_permille", objects.Number(Slot(object::kTorqueActual))},
                        {"reeled_m", drive.output().reeled_m},
                        {"tension_n", drive.output().tension_n},
                        {"winding_c", drive.winch().winding_c()},
                        {"brake_closed", drive.brake_closed()},
                        {"frames_dropped", drive.frames_dropped()}});
    }
    return {{"ran_s", 1e-6 * static_cast<double>(MonotonicTime_us() - start_us_)},
            {"frames_sent", counters.sent},
            {"frames_received", counters.received},
            {"send_dropped", counters.send_dropped},
            {"receive_dropped", counters.receive_dropped},
            {"drives", drives}};
  }

 private:
  /// Frames carry the wall clock; drives run on the monotonic one. A frame that waited while this
  /// process was held up counts with the time at which it was on the bus.
  void TakeFrames() {
    std::array<CanFrame, kBatch> frames;
    for (std::size_t looked = 0; looked < kMostFramesATurn; looked += kBatch) {
      const std::size_t count = bus_.Receive(frames);
      if (count == 0) return;
      const std::int64_t now_us = MonotonicTime_us();
      const std::int64_t offset_us = now_us - RealTime_us();
      for (std::size_t i = 0; i < count; ++i) {
        const std::int64_t stamp_us = frames[i].time_us + offset_us;
        const std::int64_t time_us = std::clamp(stamp_us, drives_.front().now_us(), now_us);
        for (Drive& drive : drives_) drive.OnFrame(frames[i], time_us);
      }
      Flush();
      ReportChanges();
    }
  }

  void Flush() {
    std::array<CanFrame, kBatch> frames;
    std::size_t count = 0;
    for (Drive& drive : drives_) {
      while (drive.TakeFrame(frames[count])) {
        if (++count < kBatch) continue;
        bus_.Send(frames);
        count = 0;
      }
    }
    if (count > 0) bus_.Send(std::span(frames).first(count));
  }

  void ReportChanges() {
    for (std::size_t i = 0; i < drives_.size(); ++i) {
      const DriveState state = drives_[i].state();
      if (state == states_[i]) continue;
      const auto code = drives_[i].objects().Number(Slot(object::kErrorCode));
      std::string line = fmt::format("{:10.3f} s  drive {:3}  {} -> {}", Elapsed_s(),
                                     drives_[i].objects().node(), Name(states_[i]), Name(state));
      if (code != 0) line += fmt::format("  ({:04X} {})", code, Name(static_cast<EmcyCode>(code)));
      if (to_output_) {
        PrintText(line + "\n");
        FlushOutput();
      } else {
        fmt::print(stderr, "{}\n", line);
      }
      states_[i] = state;
    }
  }

  double Elapsed_s() const { return 1e-6 * static_cast<double>(MonotonicTime_us() - start_us_); }

  Bus& bus_;
  bool to_output_;  ///< changes of state; else to standard error
  std::int64_t start_us_;
  std::int64_t end_us_{0};
  std::vector<Drive> drives_;
  std::vector<DriveState> states_;
};

int Run(const Options& options) {
  if (options.eds) {
    PrintText(MakeEds());
    return 0;
  }
  try {
    Check(options);
    const auto bus = OpenBus(options.bus);
    struct sigaction action {};
    action.sa_handler = RequestStop;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    Runner runner(*bus, options);
    runner.Run();
    const nlohmann::json status = runner.Status();
    if (options.json) {
      Print("{}\n", status.dump(2));
    } else {
      Print("ran {:.3f} s: {} frames sent, {} received, {} lost\n", status["ran_s"].get<double>(),
            status["frames_sent"].get<std::uint64_t>(),
            status["frames_received"].get<std::uint64_t>(),
            status["receive_dropped"].get<std::uint64_t>());
    }
    return 0;
  } catch (const std::invalid_argument& error) {
    ComplainText(error.what(), "mantle drives");
  } catch (const std::system_error& error) {
    ComplainText(error.what(), "mantle drives");
  }
  return kExitBadInput;
}

}  // namespace

void AddDrivesCommand(CLI::App& app, int& exit_status) {
  static Options options;  // lives as long as the parser that points to it
  CLI::App* command = app.add_subcommand("drives", "Runs winch drives alone on a bus");
  command->footer(kHelp);
  command->add_option("--bus", options.bus, std::string(kBusSpecHelp));
  command->add_option("--nodes", options.nodes, "Number of drives, 1..126")->capture_default_str();
  command->add_option("--first-node", options.first_node, "Node id of the first, 1..126")
      ->capture_default_str();
  CLI::Option* duration = command->add_option("--duration", options.duration_s,
                                              "Seconds to run (default: until stopped)");
  command->add_flag("--json", options.json, "Print the drives' status as JSON at the end");
  command->add_flag("--eds", options.eds, "Print the electronic data sheet (CiA 306) and stop");
  command->callback([duration, &exit_status] {
    options.has_duration = duration->count() > 0;
    exit_status = Run(options);
  });
}

}  // namespace mantle::tools
