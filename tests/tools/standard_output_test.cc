#include "tools/mantle/standard_output.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

// Every command, short, with and without --json; a log and a bus are made first.
std::vector<std::string> Commands() {
  const std::string steer = Scene("steer") + " --set time.duration=0.1";
  const std::string arm = Scene("arm_dynamic") + " --set time.duration=0.02";
  const std::string bus = "udp:239.74.163.2:" + std::to_string(20000 + getpid() % 20000) + "@lo";
  std::vector<std::string> commands = {"--help", "--version", "run --help", "drives --eds"};
  for (const std::string json : {"", " --json"}) {
    commands.push_back("check " + arm + json);
    commands.push_back("run " + arm + " --out run" + json);
    commands.push_back("run " + Scene("paper") +
                       " --set time.duration=0.02 --model reduced --out small" + json);
    commands.push_back("run " + steer + " --out loop" + json);
    commands.push_back("log loop/telemetry.lcmlog" + json);
    commands.push_back("export loop --format npz" + json);
    if (std::filesystem::exists(tests::BinaryPath("report/report.html"))) {
      commands.push_back("report loop" + json);
    }
    commands.push_back("static " + Scene("elastica") + " --out static" + json);
    commands.push_back("compare " + Scene("paper") + " --set time.duration=0.02 --out both" + json);
    commands.push_back("study control " + steer + " --controllers gait --out study" + json);
    commands.push_back("tune " + steer + " --controller gait --evaluations 3 --out tune" + json);
    commands.push_back("bus load" + json);
    commands.push_back("bus monitor --duration 0.1 --bus " + bus + json);
    commands.push_back("drives --nodes 1 --duration 0.1 --bus " + bus + json);
  }
  commands.push_back("log loop/telemetry.lcmlog --csv --channel MANTLE_STATE");
  return commands;
}

TEST(StandardOutput, ThatCannotBeWrittenIsStatusOneInOneLineForEveryCommand) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const auto folder = FreshFolder("stdout_full");
  for (const std::string& command : Commands()) {
    const Outcome outcome = Mantle(folder, command + " >/dev/full");
    EXPECT_EQ(outcome.status, 1) << command;
    EXPECT_EQ(SaidOf(outcome.err).complaints,
              "mantle: standard output cannot be written: No space left on device\n")
        << command;
  }
  // What was done is there all the same.
  EXPECT_TRUE(ReadJson(folder / "loop/summary.json").at("complete").get<bool>());
}

TEST(StandardOutput, ThatIsClosedOrLeftIsStatusOneToo) {
  const auto folder = FreshFolder("stdout_closed");
  const std::string run =
      "run " + Scene("arm_dynamic") + " --set time.duration=0.02 --out run --json";
  const Outcome closed = Mantle(folder, run + " >&-");
  EXPECT_EQ(closed.status, 1);
  EXPECT_EQ(closed.err, "mantle: standard output cannot be written: Bad file descriptor\n");
  EXPECT_TRUE(ReadJson(folder / "run/summary.json").at("complete").get<bool>())
      << "no result takes the place of standard output";
  // A reader that has left before anything is said.
  Mantle(folder, "--version >version; { sleep 0.3; " + Program() +
                     " drives --eds 2>err; echo $? >status; } | true");
  EXPECT_EQ(ReadFile(folder / "status"), "1\n");
  EXPECT_EQ(ReadFile(folder / "err"), "mantle: standard output cannot be written: Broken pipe\n");
}

TEST(StandardOutput, AWorseEndingKeepsItsStatus) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const auto folder = FreshFolder("stdout_worse");
  EXPECT_EQ(Mantle(folder, "check absent.toml >/dev/full").status, 2);
  const Outcome stopped = Mantle(folder, "run " + Scene("paper") +
                                             " --set effects.jet_thrust.runaway=1e-6 --out out "
                                             "--json >/dev/full");
  EXPECT_EQ(stopped.status, 3) << stopped.err;
  const std::string complaints = SaidOf(stopped.err).complaints;
  EXPECT_EQ(std::count(complaints.begin(), complaints.end(), '\n'), 1) << stopped.err;
}

TEST(StandardOutput, AComplaintIsOneLineWhateverItQuotes) {
  testing::internal::CaptureStderr();
  tools::ComplainText("a\nb\tc\x01\x7F");
  tools::ComplainText(std::string(1'000'000, 'x'));
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(said.substr(0, said.find('\n')), "mantle: a\\nb\\tc\\x01\\x7f");
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 2);
  EXPECT_LT(said.size(), 3000U);
}

}  // namespace
}  // namespace mantle::testing_tools
