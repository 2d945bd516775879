// Drive and master on one bus: the drive comes up.
#include "firmware_sim/bus/loop_bus.h"
#include "firmware_sim/drive/drive.h"
#include "firmware_sim/master/master.h"

int main() {
  using namespace mantle::firmware_sim;
  LoopMedium medium;
  const auto wire = medium.MakeStation();
  const auto bus = medium.MakeStation(Master::Filters());
  DriveConfig config;
  config.node = 1;
  Drive drive(config, 0);
  MasterOptions options;
  options.nodes = {1};
  Master master(*bus, options);
  master.Enable(0);
  for (int t_us = 1'000; t_us < 5'000'000 && !master.enabled(); t_us += 1'000) {
    medium.AdvanceTo(t_us);
    for (CanFrame in; wire->Receive({&in, 1}) == 1;) drive.OnFrame(in, t_us);
    drive.AdvanceTo(t_us);
    for (CanFrame out; drive.TakeFrame(out);) wire->Send({&out, 1});
    master.Poll(t_us);
    if (t_us % 10'000 == 0) master.Cycle(t_us);
  }
  return master.enabled() ? 0 : 1;
}
