#include "firmware_sim/canopen/eds.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/support/paths.h"

namespace mantle::firmware_sim {
namespace {

TEST(Eds, TheShippedFileIsTheGeneratedOne) {
  std::ifstream file(tests::SourcePath("firmware_sim/canopen/mantle_drive.eds"));
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), MakeEds())
      << "run: build/mantle drives --eds > firmware_sim/canopen/mantle_drive.eds";
}

}  // namespace
}  // namespace mantle::firmware_sim
