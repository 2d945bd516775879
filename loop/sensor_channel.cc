#include "loop/sensor_channel.h"

namespace mantle::loop {

bool SensorChannel::Send(const Sensors& message) {
  if (messages_.Push(message)) return true;
  refused_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

bool SensorChannel::Receive(Sensors* message) { return messages_.Pop(message); }

}  // namespace mantle::loop
