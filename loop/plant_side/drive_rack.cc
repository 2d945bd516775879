#include "loop/plant_side/drive_rack.h"

#include <algorithm>
#include <array>

namespace mantle::loop {

using firmware_sim::CanFrame;
using firmware_sim::Drive;

// A bus in flood must not keep the drives' clocks from going on.
constexpr std::size_t kMostFramesAPump = 4096;

DriveRack::DriveRack(firmware_sim::Bus& bus, int count, const firmware_sim::CableLoad& cable,
                     std::int64_t start_us)
    : bus_(bus) {
  drives_.reserve(count);
  for (int i = 0; i < count; ++i) {
    const auto node = static_cast<firmware_sim::NodeId>(i + 1);
    drives_.emplace_back(firmware_sim::DriveConfig{node, cable}, start_us);
  }
}

void DriveRack::Pump(std::int64_t now_us) {
  std::array<CanFrame, 64> batch;
  for (std::size_t looked = 0; looked < kMostFramesAPump; looked += batch.size()) {
    const std::size_t count = bus_.Receive(batch);
    if (count == 0) break;
    for (std::size_t i = 0; i < count; ++i) {
      for (Drive& drive : drives_) drive.OnFrame(batch[i], now_us);
    }
  }
  for (Drive& drive : drives_) {
    for (CanFrame frame; drive.TakeFrame(frame);) bus_.Send({&frame, 1});
  }
}

void DriveRack::AdvanceTo(std::int64_t now_us) {
  for (Drive& drive : drives_) drive.AdvanceTo(now_us);
}

bool DriveRack::braked() const {
  return std::all_of(drives_.begin(), drives_.end(),
                     [](const Drive& drive) { return drive.brake_closed(); });
}

}  // namespace mantle::loop
