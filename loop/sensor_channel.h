#pragma once

#include <atomic>
#include <cstddef>

#include "firmware_sim/bus/spsc_ring.h"
#include "loop/messages.h"

/// @file
/// The way of the sensor messages from the plant side to the control side, and its in-memory form.

namespace mantle::loop {

/// Where the plant side puts its messages.
class SensorSink {
 public:
  virtual ~SensorSink() = default;
  /// False where the message was not taken.
  virtual bool Send(const Sensors& message) = 0;
};

/// Where the control side finds them.
class SensorSource {
 public:
  virtual ~SensorSource() = default;
  /// The oldest message that was not received yet; false where there is none.
  virtual bool Receive(Sensors* message) = 0;
};

/// Both ends in one process, in one thread or two: a queue of fixed depth. A message that finds it
/// full is refused and counted; neither end waits for the other. Allocates only until every place
/// has held a message of the vehicle's size.
class SensorChannel final : public SensorSink, public SensorSource {
 public:
  /// `depth` messages wait at most, 1 or more.
  explicit SensorChannel(std::size_t depth = 4) : messages_(depth) {}

  bool Send(const Sensors& message) override;
  bool Receive(Sensors* message) override;

  std::size_t waiting() const { return messages_.size(); }  ///< messages
  /// Messages.
  unsigned long long refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  firmware_sim::SpscRing<Sensors> messages_;
  std::atomic<unsigned long long> refused_{0};
};

}  // namespace mantle::loop
