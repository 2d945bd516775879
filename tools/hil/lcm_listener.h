#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "loop/sensor_channel.h"
#include "tools/mantle/lcm_bridge.h"

namespace mantle::tools {

/// Hears some channels in a thread of its own and hands their messages on there. Like the fast loop
/// that waits for them it runs under SCHED_FIFO where that is permitted, and so does the thread in
/// which liblcm reads the socket.
class LcmListener {
 public:
  /// `to` must outlive it. Throws BadInput where the URL cannot be heard.
  LcmListener(const std::string& url, const std::vector<std::string>& channels, TelemetrySink& to);
  ~LcmListener();
  LcmListener(const LcmListener&) = delete;
  LcmListener& operator=(const LcmListener&) = delete;

  std::uint64_t malformed() const { return malformed_.load(std::memory_order_relaxed); }

 private:
  std::unique_ptr<LcmLink> link_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> malformed_{0};
  std::thread thread_;
};

/// The sensor messages' way onto the network.
class LcmSensorSink final : public loop::SensorSink {
 public:
  explicit LcmSensorSink(const std::string& url) : link_(OpenLcm({.url = url})) {}
  bool Send(const loop::Sensors& message) override;

 private:
  std::unique_ptr<LcmLink> link_;
};

}  // namespace mantle::tools
