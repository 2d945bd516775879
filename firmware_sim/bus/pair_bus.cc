#include "firmware_sim/bus/pair_bus.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cerrno>
#include <cstdint>
#include <ctime>
#include <system_error>
#include <vector>

#include "firmware_sim/bus/socket_time.h"
#include "firmware_sim/bus/spsc_ring.h"

namespace mantle::firmware_sim {

/// From the station that sends to the one that receives. `event` is readable while frames may wait.
struct PairBus::Way {
  explicit Way(std::size_t capacity)
      : frames(capacity), event(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (event < 0) throw std::system_error(errno, std::generic_category(), "bus loop: eventfd");
  }
  ~Way() { close(event); }

  SpscRing<CanFrame> frames;
  std::atomic<std::uint64_t> lost{0};
  int event;
};

PairBus::PairBus(std::size_t capacity)
    : ways_{std::make_unique<Way>(capacity), std::make_unique<Way>(capacity)} {}

PairBus::~PairBus() = default;

std::unique_ptr<Bus> PairBus::MakeStation(int side, std::span<const CanFilter> filters) {
  class Station final : public Bus {
   public:
    Station(Way* out, Way* in, std::span<const CanFilter> filters)
        : out_(out), in_(in), filters_(filters.begin(), filters.end()) {}

    BusStatus Send(std::span<const CanFrame> frames) override {
      const std::int64_t now_us = RealTime_us();
      for (const CanFrame& frame : frames) {
        CanFrame stamped = frame;
        stamped.time_us = now_us;
        if (!out_->frames.Push(stamped)) out_->lost.fetch_add(1, std::memory_order_relaxed);
      }
      counters_.sent += frames.size();
      const std::uint64_t one = 1;
      // Cannot fail but where the counter is full: then the other has been told.
      [[maybe_unused]] const ssize_t told = write(out_->event, &one, sizeof(one));
      return BusStatus::kOk;
    }

    std::size_t Receive(std::span<CanFrame> frames) override {
      std::size_t count = 0;
      for (std::size_t seen = 0; seen < frames.size(); ++seen) {
        const CanFrame* frame = in_->frames.Front();
        if (frame == nullptr) break;
        if (Passes(filters_, *frame)) frames[count++] = *frame;
        in_->frames.Drop();
      }
      counters_.received += count;
      return count;
    }

    BusStatus Wait(std::int64_t timeout_us) override {
      std::uint64_t told = 0;
      [[maybe_unused]] const ssize_t cleared = read(in_->event, &told, sizeof(told));
      if (in_->frames.Front() != nullptr) return BusStatus::kOk;
      pollfd waiting{.fd = in_->event, .events = POLLIN, .revents = 0};
      const timespec limit = ToTimespec(std::max<std::int64_t>(timeout_us, 0));
      ppoll(&waiting, 1, &limit, nullptr);
      return BusStatus::kOk;
    }

    BusCounters counters() const override {
      BusCounters counters = counters_;
      counters.receive_dropped = in_->lost.load(std::memory_order_relaxed);
      return counters;
    }

   private:
    Way* out_;
    Way* in_;
    std::vector<CanFilter> filters_;
    BusCounters counters_{};
  };
  assert(side == 0 || side == 1);
  return std::make_unique<Station>(ways_[side].get(), ways_[1 - side].get(), filters);
}

}  // namespace mantle::firmware_sim
