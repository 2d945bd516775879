#include "loop/plant_watch.h"

#include <cmath>

namespace mantle::loop {
namespace {

constexpr std::size_t kMostFrames = 1024, kMostSnapshots = 64;
constexpr double kSameTime_s = 1e-6;

PlantFrame MakePlantFrame(const VehicleSide& vehicle, int motors) {
  PlantFrame frame;
  frame.truth = vehicle.truth();
  frame.tension_n = vehicle.tension_n();
  frame.cable_work_j.assign(static_cast<std::size_t>(motors), 0.0);
  return frame;
}

}  // namespace

PlantWatch::PlantWatch(const VehicleSide& vehicle, PlantSide* plant, int motors,
                       const Options& options)
    : vehicle_(vehicle),
      plant_(plant),
      options_(options),
      frames_(kMostFrames, MakePlantFrame(vehicle, motors)),
      frame_(MakePlantFrame(vehicle, motors)) {
  if (plant_ == nullptr) return;
  const model::Simulation& simulation = plant_->simulation();
  snapshots_.emplace(kMostSnapshots, PlantSnapshot{{}, simulation.state(), simulation.energy()});
}

void PlantWatch::Look(double time_s) {
  frame_.time_s = time_s;
  frame_.truth = vehicle_.truth();
  frame_.tension_n = vehicle_.tension_n();
  if (options_.tip_arm >= 0) frame_.tip = vehicle_.tip(options_.tip_arm);
  for (std::size_t i = 0; i < frame_.cable_work_j.size(); ++i) {
    frame_.cable_work_j[i] = vehicle_.cable_work_j(static_cast<int>(i));
  }
  const bool at_end = std::abs(time_s - options_.end_s) < kSameTime_s;
  const bool due = time_s >= next_s_ - kSameTime_s || at_end;
  if (snapshots_ && due && time_s <= options_.end_s + kSameTime_s) {
    const double interval = options_.output_interval_s;
    next_s_ = (std::floor(time_s / interval + kSameTime_s) + 1.0) * interval;
    const model::Simulation& simulation = plant_->simulation();
    snapshots_->Push({plant_->Observe(), simulation.state(), simulation.energy()});
  }
  frames_.Push(frame_);
  braked_.store(vehicle_.braked(), std::memory_order_release);
}

const PlantSnapshot* PlantWatch::SnapshotAt(double time_s) {
  if (!snapshots_) return nullptr;
  const PlantSnapshot* snapshot = snapshots_->Front();
  while (snapshot != nullptr && snapshot->sample.time_s < time_s - kSameTime_s) {
    snapshots_->Drop();
    snapshot = snapshots_->Front();
  }
  const bool now = snapshot != nullptr && snapshot->sample.time_s < time_s + kSameTime_s;
  return now ? snapshot : nullptr;
}

}  // namespace mantle::loop
