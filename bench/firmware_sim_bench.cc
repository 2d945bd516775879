#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <vector>

#include "firmware_sim/bus/loop_bus.h"
#include "firmware_sim/bus/wire.h"
#include "firmware_sim/drive/drive.h"

/// The price of eight drives on the loop bus, a 10 ms cycle each:
///
///   whole cycle                             at most 100 us
///   of it frames and state machines         at most 20 us
///   a sub-step of one motor and its stage   at most 100 ns

namespace {

using namespace mantle::firmware_sim;

constexpr int kDrives = 8;
constexpr std::int64_t kCycle_us = 10'000;

CanFrame MakeFrame(std::uint32_t id, std::uint8_t size) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  return frame;
}

/// Eight drives, each a station of its own, and a master that sends their targets.
class Scene {
 public:
  Scene() : master_(medium_.MakeStation()) {
    for (int i = 1; i <= kDrives; ++i) {
      DriveConfig config;
      config.node = static_cast<NodeId>(i);
      drives_.emplace_back(config, 0);
      const std::array<CanFilter, 6> filters = {{{kCobNmt, 0x7FF},
                                                 {kCobSync, 0x7FF},
                                                 {CobRpdo1(config.node), 0x7FF},
                                                 {CobRpdo2(config.node), 0x7FF},
                                                 {CobSdoRequest(config.node), 0x7FF},
                                                 {CobHeartbeat(kMasterNode), 0x7FF}}};
      stations_.push_back(medium_.MakeStation(filters));
    }
    CanFrame start = MakeFrame(kCobNmt, 2);
    start.data[0] = 1;
    master_->Send({&start, 1});
    for (const int word : {6, 7, 15}) Cycle(word, kCycle_us);
    for (int i = 0; i < 200; ++i) Cycle(15, kCycle_us);
  }

  /// One cycle; with `span_us` 0 frames and state machines only, the clock stands still.
  void Cycle(int word, std::int64_t span_us) {
    SendTargets(word);
    Exchange();
    now_us_ += span_us;
    medium_.AdvanceTo(now_us_);
    for (Drive& drive : drives_) drive.AdvanceTo(now_us_);
    Exchange();
    received_ += master_->Receive(batch_);
  }

  bool all_enabled() const {
    for (const Drive& drive : drives_) {
      if (drive.state() != DriveState::kOperationEnabled) return false;
    }
    return true;
  }
  std::size_t received() const { return received_; }

 private:
  void SendTargets(int word) {
    std::array<CanFrame, 2 + 2 * kDrives> frames;
    std::size_t count = 0;
    frames[count] = MakeFrame(CobHeartbeat(kMasterNode), 1);
    frames[count++].data[0] = 5;
    for (int i = 1; i <= kDrives; ++i) {
      const auto node = static_cast<NodeId>(i);
      CanFrame& first = frames[count++] = MakeFrame(CobRpdo1(node), 8);
      first.data[0] = static_cast<std::uint8_t>(word);
      StoreLe(&first.data[2], 2, 300);
      CanFrame& second = frames[count++] = MakeFrame(CobRpdo2(node), 7);
      second.data[6] = 10;
    }
    frames[count++] = MakeFrame(kCobSync, 0);
    master_->Send({frames.data(), count});
  }

  void Exchange() {
    CanFrame out;
    for (std::size_t i = 0; i < drives_.size(); ++i) {
      const std::size_t count = stations_[i]->Receive(batch_);
      for (std::size_t k = 0; k < count; ++k) drives_[i].OnFrame(batch_[k], now_us_);
      while (drives_[i].TakeFrame(out)) stations_[i]->Send({&out, 1});
    }
  }

  LoopMedium medium_;
  std::unique_ptr<Bus> master_;
  std::vector<std::unique_ptr<Bus>> stations_;
  std::vector<Drive> drives_;
  std::array<CanFrame, 128> batch_{};
  std::int64_t now_us_{0};
  std::size_t received_{0};
};

void CycleOfEightDrives(benchmark::State& state) {
  Scene scene;
  for (auto _ : state) scene.Cycle(15, kCycle_us);
  if (!scene.all_enabled()) state.SkipWithError("a drive left operation enabled");
}
BENCHMARK(CycleOfEightDrives)->Unit(benchmark::kMicrosecond);

void FramesAndStateMachinesOfEightDrives(benchmark::State& state) {
  Scene scene;
  const std::size_t before = scene.received();
  for (auto _ : state) scene.Cycle(15, 0);
  if (!scene.all_enabled()) state.SkipWithError("a drive left operation enabled");
  state.counters["frames_to_master"] =
      static_cast<double>(scene.received() - before) / static_cast<double>(state.iterations());
}
BENCHMARK(FramesAndStateMachinesOfEightDrives)->Unit(benchmark::kMicrosecond);

void MotorSubStep(benchmark::State& state) {
  Winch winch;
  Surroundings around;
  around.cable = {0.0, 500.0, 0.0};
  WinchCommand command{true, 2.0, false};
  for (auto _ : state) {
    command.voltage_v = winch.reeled_m() > 0.001 ? 1.0 : 2.0;
    winch.Step(command, around);
    benchmark::DoNotOptimize(winch);
  }
}
BENCHMARK(MotorSubStep)->Unit(benchmark::kNanosecond);

void SdoUpload(benchmark::State& state) {
  Drive drive({}, 0);
  CanFrame request = MakeFrame(CobSdoRequest(1), 8);
  request.data = {0x40, 0x41, 0x60, 0, 0, 0, 0, 0};
  CanFrame reply;
  for (auto _ : state) {
    drive.OnFrame(request, 0);
    while (drive.TakeFrame(reply)) benchmark::DoNotOptimize(reply);
  }
}
BENCHMARK(SdoUpload)->Unit(benchmark::kNanosecond);

}  // namespace
