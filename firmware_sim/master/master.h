#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/can_filter.h"
#include "firmware_sim/master/drive_supervisor.h"

namespace mantle::firmware_sim {

inline constexpr std::size_t kMaxDrives = 16;

/// Which drives a master has, and how it treats them.
struct MasterOptions {
  std::vector<NodeId> nodes;  ///< 1 to kMaxDrives different nodes, each 1..126
  SupervisorOptions supervisor{};
};

/// Events since the master was made.
struct MasterCounters {
  std::uint64_t cycles{0};
  std::uint64_t send_failures{0};   ///< Sends that the bus refused in part or in whole
  std::uint64_t foreign_frames{0};  ///< from nodes that are not ours
};

/// The master (node 0x7F) of the drives on one bus. A program that controls drives does
///
///   Master master(*bus, options);
///   master.Enable(now_us);
///   every period:      master.Cycle(now_us);   // RPDOs, then SYNC
///   whenever frames are there, and a few times a period: master.Poll(now_us);
///   targets for the next cycle: master.SetTarget(i, target); state: master.drive(i)
///   at the end:        master.Stop(now_us), and cycles until stopped()
///
/// Targets given before Cycle k are applied by the drives at SYNC k, which samples the TPDOs that
/// Poll reads after it. `now_us` is any clock that does not go back; time stamps of frames are only
/// passed on. Nothing throws or allocates after construction.
class Master {
 public:
  /// Throws std::invalid_argument with name, value and bound. `bus` must outlive the master.
  Master(Bus& bus, const MasterOptions& options);

  /// All drives, or the `i`-th of the options' nodes; see DriveSupervisor.
  void Enable(std::int64_t now_us);
  void Enable(std::size_t i, std::int64_t now_us) { drives_[i].Enable(now_us); }
  void Stop(std::int64_t now_us);
  void SetTarget(std::size_t i, const DriveTarget& target) { drives_[i].SetTarget(target); }
  void SetMode(OperationMode mode);

  /// Reads what has come, sends what is due: SDOs, NMT commands, the heartbeat.
  void Poll(std::int64_t now_us);
  /// Sends this cycle's RPDOs and then SYNC.
  void Cycle(std::int64_t now_us);

  std::size_t drive_count() const { return drives_.size(); }
  const DriveReport& drive(std::size_t i) const { return drives_[i].report(); }
  const MasterCounters& counters() const { return counters_; }
  /// Every drive is in step `step`.
  bool AllIn(DriveStep step) const;
  bool enabled() const { return AllIn(DriveStep::kEnabled); }
  bool stopped() const;  ///< every drive is stopped, failed or lost

  /// Every TPDO1 that the last SYNC asks for has come.
  bool CycleComplete() const;

  /// What the master's station needs to receive.
  static std::vector<CanFilter> Filters();

 private:
  void Flush();

  Bus& bus_;
  SupervisorOptions options_;
  std::vector<DriveSupervisor> drives_;
  std::array<std::uint8_t, kMaxNode + 1> drive_of_node_{};
  FrameBatch out_;
  MasterCounters counters_{};
  std::int64_t next_heartbeat_us_{INT64_MIN};
};

/// Describe of every drive, one a line. Allocates.
std::string Describe(const Master& master);

}  // namespace mantle::firmware_sim
