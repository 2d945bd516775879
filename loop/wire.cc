#include "loop/wire.h"

#include <fmt/format.h>

#include <vector>

#include "firmware_sim/bus/open_bus.h"
#include "firmware_sim/master/master.h"

namespace mantle::loop {
namespace {

constexpr double kSecond_us = 1e6;
constexpr std::size_t kMostRecorded = 1 << 16;  // frames that wait to be written

}  // namespace

Wire::Wire(const std::string& spec, std::int64_t timeout_us, firmware_sim::CandumpWriter* record,
           WireTime time)
    : spec_(spec), timeout_us_(timeout_us), record_(record) {
  if (time == WireTime::kReal) {
    OpenRealTime();
    return;
  }
  const std::vector<firmware_sim::CanFilter> filters = firmware_sim::Master::Filters();
  const bool in_process = spec == "loop";
  if (in_process) medium_ = std::make_unique<firmware_sim::LoopMedium>();
  control_end_ = firmware_sim::OpenBus(spec, medium_.get(), filters);
  plant_end_ = firmware_sim::OpenBus(spec, medium_.get());
  control_bus_ = control_end_.get();
  plant_bus_ = plant_end_.get();
  if (!in_process) {
    control_link_ = std::make_unique<LockStepBus>(*control_end_, timeout_us_);
    plant_link_ = std::make_unique<LockStepBus>(*plant_end_, timeout_us_);
    control_link_->Connect(plant_link_.get());
    plant_link_->Connect(control_link_.get());
    control_bus_ = control_link_.get();
    plant_bus_ = plant_link_.get();
  }
  meter_ = std::make_unique<MeteredBus>(*control_bus_);
  control_bus_ = meter_.get();
  if (record != nullptr) {
    recorder_ = std::make_unique<firmware_sim::RecordingBus>(*control_bus_, *record);
    control_bus_ = recorder_.get();
  }
}

void Wire::OpenRealTime() {
  const std::vector<firmware_sim::CanFilter> filters = firmware_sim::Master::Filters();
  if (spec_ == "loop") {
    pair_ = std::make_unique<firmware_sim::PairBus>();
    control_end_ = pair_->MakeStation(0, filters);
    plant_end_ = pair_->MakeStation(1);
  } else {
    control_end_ = firmware_sim::OpenBus(spec_, nullptr, filters);
    plant_end_ = firmware_sim::OpenBus(spec_);
  }
  control_watch_ = std::make_unique<WatchingBus>(*control_end_);
  plant_watch_ = std::make_unique<WatchingBus>(*plant_end_);
  plant_bus_ = plant_watch_.get();
  meter_ = std::make_unique<MeteredBus>(*control_watch_);
  control_bus_ = meter_.get();
  if (record_ == nullptr) return;
  recorded_ = std::make_unique<firmware_sim::SpscRing<firmware_sim::CanFrame>>(kMostRecorded);
  tap_ = std::make_unique<TapBus>(*control_bus_, *recorded_);
  control_bus_ = tap_.get();
}

void Wire::WriteRecord() {
  if (!recorded_) return;
  for (firmware_sim::CanFrame frame; recorded_->Pop(&frame);) record_->Write(frame);
}

void Wire::AdvanceTo(std::int64_t now_us) {
  if (medium_) medium_->AdvanceTo(now_us);
  if (control_link_) {
    control_link_->AdvanceTo(now_us);
    plant_link_->AdvanceTo(now_us);
  }
  if (recorder_) recorder_->AdvanceTo(now_us);
}

Status Wire::Check() const {
  const auto describe = [&](const LockStepBus& link, const char* from) -> Status {
    return {false,
            fmt::format("bus {}: frame {:03X} that {} sent did not come within {:.3g} s", spec_,
                        link.missing().id, from, static_cast<double>(timeout_us_) / kSecond_us)};
  };
  for (const auto* link : {control_link_.get(), plant_link_.get()}) {
    if (link == nullptr || link->foreign() == 0) continue;
    return {false, fmt::format("bus {}: {} foreign frames with identifiers of this run, the first "
                               "{:03X}: another run or master is on the bus",
                               spec_, link->foreign(), link->first_foreign().id)};
  }
  for (const auto* watch : {control_watch_.get(), plant_watch_.get()}) {
    if (watch == nullptr || watch->foreign() == 0) continue;
    return {false, fmt::format("bus {}: {} foreign frames with identifiers of this run, the first "
                               "{:03X}: another run or master is on the bus",
                               spec_, watch->foreign(), watch->first_foreign())};
  }
  if (control_link_ && control_link_->stalled()) return describe(*control_link_, "the drives");
  if (plant_link_ && plant_link_->stalled()) return describe(*plant_link_, "the master");
  return {};
}

}  // namespace mantle::loop
