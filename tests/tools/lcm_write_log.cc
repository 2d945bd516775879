#include <cstdlib>

#include "tests/tools/telemetry_samples.h"
#include "tools/mantle/lcm_bridge.h"

/// lcm_write_log FOLDER SAMPLES: a log of octopus messages for lcm_log_test.py.

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto link = mantle::tools::OpenLcm({.log_folder = argv[1]});
  const int samples = std::atoi(argv[2]);
  for (int k = 0; k < samples; ++k) mantle::testing_tools::OctopusMessages(k).WriteTo(*link);
  link->FinishLog();
  return 0;
}
