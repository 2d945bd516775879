#include "tools/mantle/bus_monitor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "firmware_sim/bus/bus_load.h"
#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/open_bus.h"
#include "firmware_sim/bus/socket_time.h"
#include "firmware_sim/canopen/traffic.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/standard_output.h"

namespace mantle::tools {

namespace {

using namespace firmware_sim;
using Json = nlohmann::ordered_json;

constexpr std::int64_t kSecond_us = 1'000'000;
constexpr std::int64_t kWaitSlice_us = 100'000;

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
      PrintText(ToJson(frame, decoded).dump() + "\n");
    } else {
      Print("{:12.6f}  {}\n", static_cast<double>(frame.time_us - first_us_) * 1e-6,
            Describe(frame));
    }
  }

  void ShowLoad(std::int64_t interval_us) {
    const double percent = LoadPercent(interval_bits_, interval_us);
    most_percent_ = std::max(most_percent_, percent);
    if (options_.json) {
      PrintText(Json{{"type", "load"},
                     {"frames", interval_frames_},
                     {"percent", percent},
                     {"warn", percent > kBusLoadWarningPercent}}
                    .dump() +
                "\n");
    } else {
      Print("-- {} frames, bus load {:.1f} % of 1 Mbit/s{}\n", interval_frames_, percent,
            Warning(percent));
    }
    FlushOutput();
    interval_frames_ = 0;
    interval_bits_ = 0;
  }

  void ShowSummary(std::int64_t elapsed_us, const BusCounters& counters) const {
    const double percent = LoadPercent(bits_, elapsed_us);
    if (options_.json) {
      PrintText(Json{{"type", "summary"},
                     {"seconds", static_cast<double>(elapsed_us) * 1e-6},
                     {"frames", frames_},
                     {"services", frames_of_},
                     {"percent", percent},
                     {"receive_dropped", counters.receive_dropped},
                     {"malformed", counters.malformed},
                     {"error_frames", counters.error_frames},
                     {"recoveries", counters.recoveries}}
                    .dump() +
                "\n");
      return;
    }
    Print("== {:.1f} s, {} frames, bus load {:.1f} % of 1 Mbit/s{}\n",
          static_cast<double>(elapsed_us) * 1e-6, frames_, percent, Warning(percent));
    for (const auto& [service, count] : frames_of_) {
      Print("   {:<12} {}\n", service, count);
    }
    if (counters.receive_dropped > 0 || counters.malformed > 0 || counters.recoveries > 0) {
      Print("   lost before we read them {}, malformed {}, link recoveries {}\n",
            counters.receive_dropped, counters.malformed, counters.recoveries);
    }
    FlushOutput();
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

void Demand(bool written, const std::string& record) {
  if (!written) {
    throw CannotGoOn(fmt::format("--record: {}: cannot be written; is the disk full?", record));
  }
}

}  // namespace

int RunMonitor(const MonitorOptions& options, const std::atomic<bool>& interrupted) {
  if (options.duration_s < 0) {
    throw std::invalid_argument(
        fmt::format("--duration is {} s, must be 0 or more", options.duration_s));
  }
  const auto bus = OpenBus(options.bus);
  std::optional<CandumpWriter> log;
  if (!options.record.empty()) {
    log.emplace(options.record, options.bus.starts_with("can:") ? options.bus.substr(4) : "vcan0");
  }
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
    if (log) Demand(log->good(), options.record);
    if (count > 0 && count < batch.size()) FlushOutput();
    now_us = MonotonicTime_us();
    if (now_us - interval_begin_us >= kSecond_us) {
      monitor.ShowLoad(now_us - interval_begin_us);
      interval_begin_us = now_us;
    }
  }
  monitor.ShowSummary(now_us - begin_us, bus->counters());
  if (log) Demand(log->Flush(), options.record);
  return 0;
}

}  // namespace mantle::tools
