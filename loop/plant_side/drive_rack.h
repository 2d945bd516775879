#pragma once

#include <cstdint>
#include <vector>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/drive/drive.h"

namespace mantle::loop {

/// The drives of a vehicle, nodes 1 to N, behind one station of the bus. Time is an input; nothing
/// allocates after construction.
class DriveRack {
 public:
  /// Powers the drives up at `start_us`. `bus` must outlive the rack.
  DriveRack(firmware_sim::Bus& bus, int count, const firmware_sim::CableLoad& cable,
            std::int64_t start_us);

  /// Hands every frame that came to the drives, at `now_us`, and sends what they answer.
  void Pump(std::int64_t now_us);
  /// Runs the drives' clocks and motors up to `now_us`.
  void AdvanceTo(std::int64_t now_us);

  /// Every drive has let go and closed its brake.
  bool braked() const;

  int size() const { return static_cast<int>(drives_.size()); }
  firmware_sim::Drive& operator[](int i) { return drives_[i]; }
  const firmware_sim::Drive& operator[](int i) const { return drives_[i]; }

 private:
  firmware_sim::Bus& bus_;
  std::vector<firmware_sim::Drive> drives_;
};

}  // namespace mantle::loop
