#include <cstdio>
#include <cstdlib>

#include "tests/firmware_sim/drive_bench.h"
#include "tests/firmware_sim/fuzz_drive.h"

/// The libFuzzer target for SDO, PDO, NMT and SYNC decoding; built and run by tools/fuzz. The first
/// byte chooses how far a master has brought the drive before the fuzzer takes over.

namespace {

using namespace mantle::firmware_sim;
using namespace mantle::firmware_sim::test;

void BringUp(FuzzedDrive& drive, unsigned steps) {
  constexpr std::int64_t kWait_us = 1'000;
  if (steps > 0) drive.Put(Frame(kCobNmt, {1, 0}), kWait_us);
  for (const unsigned word : {6U, 7U, 15U}) {
    if (steps-- < 2) return;
    drive.Put(Frame(CobRpdo1(5), {word, 0, 0xC8, 0, 0, 0, 0, 0}), kWait_us);
    drive.Put(Frame(kCobSync, {}), kWait_us);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  FuzzedDrive drive;
  BringUp(drive, data[0] % 5);
  if (const char* wrong = PutAll(drive, {data + 1, size - 1})) {
    std::fprintf(stderr, "%s\n", wrong);
    std::abort();
  }
  return 0;
}
