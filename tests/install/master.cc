// A master alone on its bus waits for its drive.
#include "firmware_sim/master/master.h"

#include "firmware_sim/bus/loop_bus.h"

int main() {
  using namespace mantle::firmware_sim;
  LoopMedium medium;
  const auto bus = medium.MakeStation(Master::Filters());
  MasterOptions options;
  options.nodes = {1};
  Master master(*bus, options);
  master.Enable(0);
  for (int t_us = 0; t_us < 1'000'000; t_us += 10'000) master.Poll(t_us);
  return master.drive_count() == 1 && !master.enabled() ? 0 : 1;
}
