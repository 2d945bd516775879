#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

#include "tests/support/paths.h"

/// The program `mantle drives` as a user meets it: exit status and messages. What it does on a bus
/// is tested in process and on a real vcan.

namespace {

struct Outcome {
  int status{-1};
  std::string text;  ///< stdout and stderr
};

Outcome RunProgram(const std::string& arguments) {
  const std::string command = mantle::tests::BinaryPath("mantle drives ") + arguments + " 2>&1";
  Outcome outcome;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) outcome.text += buffer.data();
  outcome.status = WEXITSTATUS(pclose(pipe));
  return outcome;
}

struct BadInput {
  const char* arguments;
  const char* says;
};
constexpr BadInput kBadInputs[] = {
    {"", "--bus missing"},
    {"--bus can:vcan0 --nodes 0", "--nodes 0 outside 1..126"},
    {"--bus can:vcan0 --nodes 127", "--nodes 127 outside 1..126"},
    {"--bus can:vcan0 --nodes 8 --first-node 120", "--nodes 8 outside 1..7"},
    {"--bus can:vcan0 --first-node 127", "--first-node 127 outside 1..126"},
    {"--bus can:vcan0 --duration 0", "--duration 0 s outside"},
    {"--bus can:vcan0 --duration nan", "--duration nan s outside"},
    {"--bus can:vcan0 --duration -1", "--duration -1 s outside"},
    {"--bus carrier-pigeon", "carrier-pigeon"},
    {"--bus can:no-such-bus0", "no-such-bus0"},
    {"--bus loop", "loop"},
};

TEST(CommandDrives, BadInputIsOneLineAndStatusTwo) {
  for (const BadInput& bad : kBadInputs) {
    const Outcome outcome = RunProgram(bad.arguments);
    EXPECT_EQ(outcome.status, 2) << bad.arguments;
    EXPECT_NE(outcome.text.find(bad.says), std::string::npos) << outcome.text;
    EXPECT_EQ(outcome.text.find('\n'), outcome.text.size() - 1) << outcome.text;
  }
}

TEST(CommandDrives, HelpTeachesTheFirstFrames) {
  const Outcome outcome = RunProgram("--help");
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.text.find("cansend vcan0 000#0100"), std::string::npos);
}

TEST(CommandDrives, EdsIsPrinted) {
  const Outcome outcome = RunProgram("--eds");
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.text.rfind("[FileInfo]", 0), 0U);
}

}  // namespace
