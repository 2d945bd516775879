#include "firmware_sim/master/master.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace mantle::firmware_sim {

namespace {

constexpr std::uint8_t kNoDrive = 0xFF;
constexpr std::size_t kReceiveBatch = 64;
// A bus in flood must not keep Poll from sending the heartbeat.
constexpr std::size_t kMostFramesAPoll = 4096;

}  // namespace

Master::Master(Bus& bus, const MasterOptions& options) : bus_(bus), options_(options.supervisor) {
  CheckSettings(options.supervisor.settings);
  if (options.nodes.empty() || options.nodes.size() > kMaxDrives) {
    throw std::invalid_argument(fmt::format("master: number of drives is {}, must be 1 to {}",
                                            options.nodes.size(), kMaxDrives));
  }
  drive_of_node_.fill(kNoDrive);
  drives_.reserve(options.nodes.size());
  for (const NodeId node : options.nodes) {
    if (node < 1 || node >= kMasterNode) {
      throw std::invalid_argument(
          fmt::format("master: node is {}, must be 1 to {}", node, kMasterNode - 1));
    }
    if (drive_of_node_[node] != kNoDrive) {
      throw std::invalid_argument(fmt::format("master: node {} is named twice", node));
    }
    drive_of_node_[node] = static_cast<std::uint8_t>(drives_.size());
    drives_.emplace_back(node, options.supervisor);
  }
}

void Master::Enable(std::int64_t now_us) {
  for (DriveSupervisor& drive : drives_) drive.Enable(now_us);
}

void Master::Stop(std::int64_t now_us) {
  for (DriveSupervisor& drive : drives_) drive.Stop(now_us);
}

void Master::SetMode(OperationMode mode) {
  for (DriveSupervisor& drive : drives_) drive.SetMode(mode);
}

void Master::Flush() {
  if (out_.empty()) return;
  if (bus_.Send(out_.frames()) != BusStatus::kOk) ++counters_.send_failures;
  out_.Clear();
}

void Master::Poll(std::int64_t now_us) {
  std::array<CanFrame, kReceiveBatch> batch;
  for (std::size_t total = 0; total < kMostFramesAPoll;) {
    const std::size_t count = bus_.Receive(batch);
    for (std::size_t i = 0; i < count; ++i) {
      const CanFrame& frame = batch[i];
      if (frame.extended || frame.remote || frame.error || frame.id <= kCobSync) continue;
      const std::uint8_t drive = drive_of_node_[frame.id & kMaxNode];
      if (drive == kNoDrive) {
        ++counters_.foreign_frames;
      } else {
        drives_[drive].OnFrame(frame, now_us);
      }
    }
    total += count;
    if (count < batch.size()) break;
  }
  if (now_us >= next_heartbeat_us_) {
    CanFrame heartbeat;
    heartbeat.id = CobHeartbeat(kMasterNode);
    heartbeat.size = 1;
    heartbeat.data[0] = static_cast<std::uint8_t>(NmtState::kOperational);
    out_.Push(heartbeat);
    next_heartbeat_us_ = now_us + options_.settings.master_heartbeat_us;
  }
  for (DriveSupervisor& drive : drives_) drive.Advance(now_us, out_);
  Flush();
}

void Master::Cycle(std::int64_t now_us) {
  for (DriveSupervisor& drive : drives_) drive.Cycle(now_us, out_);
  CanFrame sync;
  sync.id = kCobSync;
  out_.Push(sync);
  Flush();
  ++counters_.cycles;
}

bool Master::AllIn(DriveStep step) const {
  return std::all_of(drives_.begin(), drives_.end(),
                     [step](const DriveSupervisor& drive) { return drive.report().step == step; });
}

bool Master::stopped() const {
  return std::all_of(drives_.begin(), drives_.end(), [](const DriveSupervisor& drive) {
    const DriveStep step = drive.report().step;
    return step == DriveStep::kStopped || step == DriveStep::kFailed || step == DriveStep::kLost;
  });
}

bool Master::CycleComplete() const {
  return std::all_of(drives_.begin(), drives_.end(),
                     [](const DriveSupervisor& drive) { return drive.complete(); });
}

std::vector<CanFilter> Master::Filters() {
  // Function codes of what drives send; 0x780 leaves the node open.
  return {{CobEmcy(0), 0x780},
          {CobTpdo1(0), 0x780},
          {CobTpdo2(0), 0x780},
          {CobSdoReply(0), 0x780},
          {CobHeartbeat(0), 0x780}};
}

std::string Describe(const Master& master) {
  std::string text;
  for (std::size_t i = 0; i < master.drive_count(); ++i) {
    text += Describe(master.drive(i)) + "\n";
  }
  return text;
}

}  // namespace mantle::firmware_sim
