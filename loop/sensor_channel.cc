#include "loop/sensor_channel.h"

namespace mantle::loop {

bool SensorChannel::Send(const Sensors& message) {
  if (waiting_ == places_.size()) {
    ++refused_;
    return false;
  }
  places_[(first_ + waiting_) % places_.size()] = message;
  ++waiting_;
  return true;
}

bool SensorChannel::Receive(Sensors* message) {
  if (waiting_ == 0) return false;
  *message = places_[first_];
  first_ = (first_ + 1) % places_.size();
  --waiting_;
  return true;
}

}  // namespace mantle::loop
