#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "firmware_sim/bus/fault_injecting_bus.h"
#include "firmware_sim/bus/loop_bus.h"
#include "firmware_sim/drive/drive.h"
#include "firmware_sim/master/master.h"

/// A master and real drives on one in-process bus, stepped by hand.

namespace mantle::firmware_sim {

/// A drive and its station.
struct Station {
  Station(NodeId node, std::unique_ptr<Bus> station_bus, std::int64_t start_us)
      : bus(std::move(station_bus)), drive(DriveConfig{.node = node}, start_us) {}

  void Pump(std::int64_t now_us) {
    if (!powered) {
      Discard();
      return;
    }
    CanFrame batch[32];
    for (std::size_t count = 0; (count = bus->Receive(batch)) > 0;) {
      for (std::size_t i = 0; i < count; ++i) drive.OnFrame(batch[i], now_us);
    }
    drive.AdvanceTo(now_us);
    for (CanFrame frame; drive.TakeFrame(frame);) bus->Send({&frame, 1});
  }

  void Discard() {
    CanFrame batch[32];
    while (bus->Receive(batch) > 0) {
    }
  }

  /// Power off and on again.
  void Reboot(std::int64_t now_us) {
    Discard();
    drive = Drive(DriveConfig{.node = drive.objects().node()}, now_us);
  }

  std::unique_ptr<Bus> bus;
  Drive drive;
  bool powered{true};
};

inline MasterOptions NodesOneTo(int count) {
  MasterOptions options;
  for (int node = 1; node <= count; ++node) options.nodes.push_back(static_cast<NodeId>(node));
  return options;
}

class Rig {
 public:
  static constexpr std::int64_t kTick_us = 1000;

  explicit Rig(int drive_count, MasterOptions options, FaultOptions faults = {},
               LoopOptions wire = {})
      : medium(wire),
        master_station(medium.MakeStation(Master::Filters())),
        cable(*master_station, faults),
        master(cable, options),
        period_us(options.supervisor.settings.period_us) {
    for (int node = 1; node <= drive_count; ++node) AddDrive(static_cast<NodeId>(node));
  }
  explicit Rig(int drive_count) : Rig(drive_count, NodesOneTo(drive_count)) {}

  void AddDrive(NodeId node) {
    stations.push_back(std::make_unique<Station>(node, medium.MakeStation(), now_us));
  }

  /// One tick of 1 ms: the master polls, on its period it cycles, then the drives run.
  void Tick() {
    now_us += kTick_us;
    medium.AdvanceTo(now_us);
    cable.AdvanceTo(now_us);
    if (master_alive) {
      master.Poll(now_us);
      if (now_us % period_us == 0 && syncs) {
        if (before_cycle) before_cycle();
        master.Cycle(now_us);
      }
    }
    for (auto& station : stations) station->Pump(now_us);
  }
  void Run(std::int64_t span_us) {
    for (const std::int64_t end_us = now_us + span_us; now_us < end_us;) Tick();
  }
  /// Runs until `done`, at most `limit_us`; returns whether it came true.
  bool RunUntil(const std::function<bool()>& done, std::int64_t limit_us) {
    for (const std::int64_t end_us = now_us + limit_us; now_us < end_us;) {
      Tick();
      if (done()) return true;
    }
    return false;
  }
  bool RunUntilEnabled(std::int64_t limit_us = 3'000'000) {
    return RunUntil([this] { return master.enabled(); }, limit_us);
  }

  Drive& drive(std::size_t i) { return stations[i]->drive; }

  LoopMedium medium;
  std::unique_ptr<Bus> master_station;
  FaultInjectingBus cable;
  Master master;
  std::int64_t period_us;
  std::vector<std::unique_ptr<Station>> stations;
  std::int64_t now_us{0};
  bool master_alive{true};
  bool syncs{true};
  std::function<void()> before_cycle;
};

}  // namespace mantle::firmware_sim
