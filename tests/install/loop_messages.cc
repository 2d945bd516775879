// A message goes through the in-memory channel.
#include "loop/sensor_channel.h"

int main() {
  mantle::loop::SensorChannel channel(2);
  mantle::loop::Sensors message;
  message.time_s = 0.5;
  mantle::loop::Sensors received;
  return channel.Send(message) && channel.Receive(&received) && received.time_s == 0.5 &&
                 !channel.Receive(&received)
             ? 0
             : 1;
}
