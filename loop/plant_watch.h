#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "firmware_sim/bus/spsc_ring.h"
#include "loop/plant_side/plant_side.h"

namespace mantle::loop {

/// Of a vehicle at a SYNC.
struct PlantFrame {
  double time_s{0};
  reduced::ReducedState truth;
  model::VectorX tension_n;
  model::Vector3 tip{model::Vector3::Zero()};  ///< of the arm that the goal is about
  std::vector<double> cable_work_j;
};

/// The full plant at an output instant, by value.
struct PlantSnapshot {
  model::Sample sample;
  model::PlantState state;
  model::EnergyAccount energy;
};

/// What a vehicle in a thread of its own does, for a listener in another: by value, through queues
/// in which neither waits for the other.
class PlantWatch {
 public:
  /// Of the snapshots.
  struct Options {
    double end_s{0};              ///< snapshots end there, with one
    double output_interval_s{1};  ///< of snapshots
    int tip_arm{-1};              ///< -1: of no interest
  };
  /// `plant`, of the vehicle, is null where that is of a user's own: then there are no snapshots.
  /// Both must outlive it.
  PlantWatch(const VehicleSide& vehicle, PlantSide* plant, int motors, const Options& options);

  /// From the vehicle's thread, after its Look(time_s).
  void Look(double time_s);

  // From the listener's.

  bool Receive(PlantFrame* frame) { return frames_.Pop(frame); }
  /// The snapshot of this time; null where there is none. Earlier ones are dropped.
  const PlantSnapshot* SnapshotAt(double time_s);
  /// The oldest snapshot, until DropSnapshot.
  const PlantSnapshot* Front() const { return snapshots_ ? snapshots_->Front() : nullptr; }
  void DropSnapshot() { snapshots_->Drop(); }
  /// VehicleSide::braked at the last Look.
  bool braked() const { return braked_.load(std::memory_order_acquire); }

 private:
  const VehicleSide& vehicle_;
  PlantSide* plant_;
  Options options_;
  firmware_sim::SpscRing<PlantFrame> frames_;
  std::optional<firmware_sim::SpscRing<PlantSnapshot>> snapshots_;
  PlantFrame frame_;  ///< of the vehicle's thread
  double next_s_{0};  ///< alike: of a snapshot
  std::atomic<bool> braked_{false};
};

}  // namespace mantle::loop
