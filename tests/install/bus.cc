// Two stations in process: what one sends, the other receives.
#include "firmware_sim/bus/open_bus.h"

int main() {
  using namespace mantle::firmware_sim;
  LoopMedium medium;
  const auto sender = OpenBus("loop", &medium), receiver = OpenBus("loop", &medium);
  const CanFrame sent[] = {{.id = 0x181, .size = 1, .data = {42}}};
  CanFrame received[2];
  const bool taken = sender->Send(sent) == BusStatus::kOk;
  return taken && receiver->Receive(received) == 1 && received[0].data[0] == 42 ? 0 : 1;
}
