// A drive boots: its first frame is the boot-up message of its node.
#include "firmware_sim/drive/drive.h"

int main() {
  using namespace mantle::firmware_sim;
  DriveConfig config;
  config.node = 5;
  Drive drive(config, 0);
  drive.AdvanceTo(100'000);
  CanFrame frame;
  return drive.TakeFrame(frame) && frame.id == 0x705 && frame.data[0] == 0 ? 0 : 1;
}
