// A master without drives asks who is there, and is not ready.
#include "firmware_sim/bus/loop_bus.h"
#include "loop/control_side/motor_master.h"

int main() {
  using namespace mantle;
  firmware_sim::LoopMedium medium;
  const auto mine = medium.MakeStation(), other = medium.MakeStation();
  loop::MotorMaster master(*mine, 1, {});
  if (!master.BringUp(0).ok) return 1;
  master.Sync(0);
  firmware_sim::CanFrame frame;
  return !master.ready() && other->Receive({&frame, 1}) == 1 ? 0 : 2;
}
