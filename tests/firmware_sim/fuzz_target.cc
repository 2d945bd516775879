#include <cstdio>
#include <cstdlib>

#include "tests/firmware_sim/fuzz_drive.h"

/// The libFuzzer target for SDO, PDO, NMT and SYNC decoding; built and run by tools/fuzz.

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  mantle::firmware_sim::test::FuzzedDrive drive;
  if (const char* wrong = mantle::firmware_sim::test::PutAll(drive, {data, size})) {
    std::fprintf(stderr, "%s\n", wrong);
    std::abort();
  }
  return 0;
}
