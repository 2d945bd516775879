#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "firmware_sim/bus/bus_load.h"
#include "tests/support/paths.h"
#include "tests/tools/program.h"

/// `mantle run` of the steering scene, its first second, on a coarser plant.

namespace mantle::testing_tools {
namespace {

const std::string kShort =
    "run " + Scene("steer") +
    " --set time.duration=1 --set mantle.elements=16 --set arms.arm.elements=8";
constexpr int kMotors = 5, kCycles = 100, kPlans = 20, kSamples = 51;

std::set<std::string> FilesIn(const std::filesystem::path& folder) {
  std::set<std::string> files;
  for (const auto& f : std::filesystem::directory_iterator(folder)) {
    files.insert(f.path().filename().string());
  }
  return files;
}

/// A table with one list of numbers per title.
std::map<std::string, std::vector<double>> ReadColumns(const std::filesystem::path& path) {
  std::istringstream in(ReadFile(path));
  std::vector<std::string> titles;
  std::map<std::string, std::vector<double>> columns;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::size_t i = 0;
    for (std::string cell; std::getline(cells, cell, ','); ++i) {
      if (columns.size() < i + 1 && titles.size() <= i) {
        titles.push_back(cell);
      } else {
        columns[titles.at(i)].push_back(std::stod(cell));
      }
    }
  }
  return columns;
}

/// What is not the same bits on every run: figures of the wall clock.
nlohmann::json WithoutWallTime(nlohmann::json summary) {
  summary.erase("wall_time_s");
  summary.erase("realtime_factor");
  for (const char* key : {"prepare_ms", "solve_ms", "step_ms", "step_histogram"}) {
    EXPECT_EQ(summary["control"]["solver"].erase(key), 1U) << key;
  }
  return summary;
}

class ClosedLoopRun : public testing::Test {
 protected:
  std::filesystem::path folder_ =
      FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());

  Outcome Run(const std::string& more) { return Mantle(folder_, kShort + " " + more); }
};

TEST_F(ClosedLoopRun, LeavesSummaryTrajectoryTelemetryAndSolverTimes) {
  const Outcome outcome = Run("--out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // Nothing but warnings of the run: the mantle works beyond the pressure of its lobes.
  EXPECT_NE(outcome.err.find("goes into lobes"), std::string::npos) << outcome.err;
  std::istringstream lines(outcome.err);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_EQ(line.rfind("mantle: warning: ", 0), 0u) << line;
  }
  for (const char* told : {"4 waypoints in turn", "error", "waypoint 1", "index", "median / p99",
                           "% of 1 Mbit/s", "5 of 5 stopped as they should, no emergency"}) {
    EXPECT_NE(outcome.out.find(told), std::string::npos) << told << "\n" << outcome.out;
  }
  EXPECT_EQ(
      FilesIn(folder_ / "out"),
      (std::set<std::string>{"solver.csv", "summary.json", "telemetry.lcmlog", "trajectory.csv"}));
  const auto summary = ReadJson(folder_ / "out/summary.json");
  EXPECT_EQ(summary.at("complete"), true);
  EXPECT_DOUBLE_EQ(summary.at("sim_time_s"), 1.0);
  EXPECT_LE(summary.at("power_balance_residual"), 1e-10) << "of the plant that cables pull";
  const auto& control = summary.at("control");
  EXPECT_EQ(control.at("controller"), "mpc");
  EXPECT_EQ(control.at("mode"), "rti");
  EXPECT_EQ(control.at("waypoints").size(), 4U);
  EXPECT_GT(control.at("cost"), 0.0);
  double terms = 0;
  for (const auto& [name, cost] : control.at("cost_terms").items()) {
    EXPECT_GE(cost, 0.0) << name;
    terms += cost.get<double>();
  }
  EXPECT_NEAR(control.at("cost"), terms, 1e-12 * terms);
  for (const char* name : {"position", "heading", "turn_rate", "effort", "rate"}) {
    EXPECT_TRUE(control.at("cost_terms").contains(name)) << name;
  }
  EXPECT_GT(control.at("effort_n2_s"), 0.0);
  EXPECT_GT(control.at("cable_work_j"), 0.0);
  EXPECT_EQ(control.at("motor_periods"), kMotors * kCycles);
  const auto& error = control.at("error");
  EXPECT_EQ(error.at("name"), "position_m");
  EXPECT_GE(error.at("max"), error.at("mean").get<double>());
  const auto& solver = control.at("solver");
  EXPECT_EQ(solver.at("plans"), kPlans);
  EXPECT_LE(solver.at("step_ms").at("median"), solver.at("step_ms").at("max").get<double>());
  int counted = 0;
  for (const auto& [words, count] : solver.at("outcomes").items()) counted += count.get<int>();
  EXPECT_EQ(counted, kPlans);
  for (const auto& drive : control.at("drives")) EXPECT_EQ(drive.at("step"), "stopped");
  EXPECT_TRUE(control.at("real_time").is_null());
}

TEST_F(ClosedLoopRun, TheTrajectoryHoldsWhatWasAskedAndWhatPulled) {
  ASSERT_EQ(Run("--out out").status, 0);
  const auto columns = ReadColumns(folder_ / "out/trajectory.csv");
  for (const auto& [title, values] : columns) {
    ASSERT_EQ(values.size(), static_cast<std::size_t>(kSamples)) << title;
    for (const double value : values) ASSERT_TRUE(std::isfinite(value)) << title;
  }
  EXPECT_EQ(columns.at("time_s").back(), 1.0);
  const auto summary = ReadJson(folder_ / "out/summary.json");
  EXPECT_EQ(columns.at("root_z_m").back(), summary["final"]["root"]["position_m"][2].get<double>());
  EXPECT_EQ(columns.at("error_position_m").back(),
            summary["control"]["error"]["final"].get<double>());
  // The error is that of the columns.
  double square = 0;
  for (const char* axis : {"x", "y", "z"}) {
    square += std::pow(columns.at(std::string("root_") + axis + "_m").back() -
                           columns.at(std::string("reference_") + axis + "_m").back(),
                       2);
  }
  constexpr double kRoundOff = 1e-12;
  EXPECT_NEAR(columns.at("error_position_m").back(), std::sqrt(square), kRoundOff);
  // Spokes are the mantle motor's one cable: what the motor pulls with is the cable's tension, but
  // for the last change of the plant's Newton iteration.
  constexpr double kNewton_n = 5e-6;
  for (int i = 0; i < kSamples; ++i) {
    EXPECT_NEAR(columns.at("actual_mantle_n")[i], columns.at("mantle_squeeze_tension_n")[i],
                kNewton_n);
  }
  EXPECT_GT(*std::max_element(columns.at("command_mantle_n").begin(),
                              columns.at("command_mantle_n").end()),
            0.1)
      << "it swims";
}

TEST_F(ClosedLoopRun, EveryKeyAndColumnIsDocumented) {
  ASSERT_EQ(Run("--out out").status, 0);
  const std::string page = ReadFile(tests::SourcePath("docs/outputs.md"));
  const auto documented = [&](const std::string& name) {
    return page.find("`" + name + "`") != std::string::npos;
  };
  const auto control = ReadJson(folder_ / "out/summary.json")["control"];
  for (const auto& [key, value] : control.items()) EXPECT_TRUE(documented(key)) << key;
  for (const char* table : {"error", "solver", "bus"}) {
    for (const auto& [key, value] : control[table].items()) EXPECT_TRUE(documented(key)) << key;
  }
  for (const auto& [key, value] : control["drives"][0].items()) EXPECT_TRUE(documented(key)) << key;
  const auto columns = ReadColumns(folder_ / "out/trajectory.csv");
  for (const char* stem :
       {"command_MOTOR_n", "actual_MOTOR_n", "reference_x_m", "error_position_m"}) {
    std::string title = stem;
    if (const auto at = title.find("MOTOR"); at != std::string::npos)
      title.replace(at, 5, "mantle");
    EXPECT_TRUE(documented(stem)) << stem;
    EXPECT_EQ(columns.count(title), 1U) << title;
  }
}

TEST_F(ClosedLoopRun, TelemetryOfEveryChannelIsInTheLogAtItsRate) {
  ASSERT_EQ(Run("--out out").status, 0);
  const Outcome log = Mantle(folder_, "log out/telemetry.lcmlog --json");
  ASSERT_EQ(log.status, 0) << log.err;
  const auto channels = nlohmann::json::parse(log.out).at("channels");
  ASSERT_EQ(channels.size(), 9U);
  for (const auto& [name, channel] : channels.items()) {
    EXPECT_EQ(channel.at("messages"), name == "MANTLE_PLAN" ? kPlans : kSamples) << name;
    const Outcome table = Mantle(folder_, "log out/telemetry.lcmlog --csv --channel " + name);
    EXPECT_EQ(table.status, 0) << table.err;
    EXPECT_EQ(table.out.find("nan"), std::string::npos) << name;
  }
  const Outcome table = Mantle(folder_, "log out/telemetry.lcmlog --csv --channel MANTLE_STATE");
  std::istringstream in(table.out);
  std::string last;
  for (std::string line; std::getline(in, line);) last = line;
  EXPECT_EQ(last.rfind("1000000,", 0), 0U) << last.substr(0, 40);
}

TEST_F(ClosedLoopRun, TheSameSceneGivesTheSameBits) {
  for (const std::string run : {"a", "b"}) {
    ASSERT_EQ(Run("--out " + run + " --record " + run + ".log").status, 0);
  }
  EXPECT_EQ(ReadFile(folder_ / "a/trajectory.csv"), ReadFile(folder_ / "b/trajectory.csv"));
  EXPECT_EQ(ReadFile(folder_ / "a/telemetry.lcmlog"), ReadFile(folder_ / "b/telemetry.lcmlog"));
  EXPECT_EQ(ReadFile(folder_ / "a.log"), ReadFile(folder_ / "b.log"));
  EXPECT_EQ(WithoutWallTime(ReadJson(folder_ / "a/summary.json")),
            WithoutWallTime(ReadJson(folder_ / "b/summary.json")));
}

TEST_F(ClosedLoopRun, AMulticastBusCarriesTheSameFramesToTheSameMotion) {
  const std::string spec = "udp:239.74.163.2:" + std::to_string(20000 + getpid() % 20000) + "@lo";
  ASSERT_EQ(Run("--out loop --record loop.log").status, 0);
  const Outcome outcome = Run("--out udp --record udp.log --bus " + spec);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(ReadFile(folder_ / "udp/trajectory.csv"), ReadFile(folder_ / "loop/trajectory.csv"));
  EXPECT_EQ(ReadFile(folder_ / "udp/telemetry.lcmlog"),
            ReadFile(folder_ / "loop/telemetry.lcmlog"));
  EXPECT_EQ(ReadFile(folder_ / "udp.log"), ReadFile(folder_ / "loop.log"));
  EXPECT_EQ(ReadJson(folder_ / "udp/summary.json")["control"]["bus"]["spec"], spec);
}

TEST_F(ClosedLoopRun, TwoRunsOnOneBusEndNamed) {
  const std::string spec = "udp:239.74.163.2:" + std::to_string(20000 + getpid() % 20000) + "@lo";
  const std::string run = Program() + " " + kShort + " --set time.duration=20 --bus " + spec;
  Mantle(folder_, "--version >version; " + run + " --out a 2>a.err & p=$!; " + run +
                      " --out b 2>b.err; echo $? >b.status; wait $p; echo $? >a.status");
  for (const std::string name : {"a", "b"}) {
    EXPECT_EQ(ReadFile(folder_ / (name + ".status")), "3\n");
    EXPECT_FALSE(std::filesystem::exists(folder_ / name));
  }
  const std::string said = ReadFile(folder_ / "a.err") + ReadFile(folder_ / "b.err");
  EXPECT_NE(said.find("foreign frames with identifiers of this run"), std::string::npos) << said;
}

TEST_F(ClosedLoopRun, TheBusLoadIsThatOfTheScenesTraffic) {
  ASSERT_EQ(Run("--out out").status, 0);
  const auto bus = ReadJson(folder_ / "out/summary.json")["control"]["bus"];
  // Two PDOs each way and a heartbeat every 100 ms at most: the table of
  // firmware_sim/bus/bus_load.h without and with all of them.
  const auto least = firmware_sim::LoadOfScene({.drives = kMotors, .rpdos = 1, .tpdos = 1});
  const auto most = firmware_sim::LoadOfScene(
      {.drives = kMotors, .rpdos = 2, .tpdos = 2, .heartbeat_us = 50'000});
  EXPECT_GE(bus.at("load"), 0.01 * least.worst_percent);
  EXPECT_LE(bus.at("load"), 0.01 * most.worst_percent);
  EXPECT_GE(bus.at("load_peak"), bus.at("load").get<double>());
  EXPECT_GE(bus.at("frames"), kCycles * (1 + 2 * kMotors));
  EXPECT_EQ(bus.at("tpdos_late"), 0);
}

TEST_F(ClosedLoopRun, OpenLoopIsThePlantAlone) {
  ASSERT_EQ(Run("--out out").status, 0);
  const Outcome outcome = Run("--out out --open-loop");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(FilesIn(folder_ / "out"),
            (std::set<std::string>{"summary.json", "telemetry.lcmlog", "trajectory.csv"}))
      << "nothing of the run before";
  EXPECT_FALSE(ReadJson(folder_ / "out/summary.json").contains("control"));
}

TEST_F(ClosedLoopRun, RealTimeIsPacedByTheWallClockAndCountsWhatIsLate) {
  const Outcome outcome = Run("--out out --realtime");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto summary = ReadJson(folder_ / "out/summary.json");
  EXPECT_GE(summary.at("wall_time_s"), 0.99) << "the first cycle begins at once";
  const auto& real_time = summary.at("control").at("real_time");
  EXPECT_EQ(real_time.at("cycles"), kCycles);
  EXPECT_GE(real_time.at("late_cycles"), 0);
  EXPECT_LE(real_time.at("late_cycles"), kCycles);
  const Outcome plans = Mantle(folder_, "log out/telemetry.lcmlog --csv --channel MANTLE_PLAN");
  EXPECT_EQ(plans.out.find(",0\n"), std::string::npos) << "solve_time_us is told";
}

TEST_F(ClosedLoopRun, AnInterruptTakesTheDrivesDownAndKeepsWhatWasReached) {
  const Outcome outcome =
      Mantle(folder_,
             kShort +
                 " --set time.duration=1e4 --out out --record bus.log & p=$!; "
                 "while [ $(wc -l < out.partial/solver.csv 2>/dev/null || echo 0) -lt 1 ] && kill "
                 "-0 $p; do sleep 0.05; done; sleep 1; kill -INT $p; wait $p");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("interrupted at t = "), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  EXPECT_EQ(
      FilesIn(folder_ / "out.partial"),
      (std::set<std::string>{"solver.csv", "summary.json", "telemetry.lcmlog", "trajectory.csv"}));
  const auto summary = ReadJson(folder_ / "out.partial/summary.json");
  EXPECT_EQ(summary.at("reason"), "interrupted");
  for (const auto& drive : summary.at("control").at("drives")) {
    EXPECT_EQ(drive.at("step"), "stopped") << drive.dump();
  }
}

TEST_F(ClosedLoopRun, ARunThatCannotGoOnSaysWhyAndKeepsWhatItReached) {
  // The first pulses thrust with more than this bound, beyond which the jet is said to run away.
  const Outcome outcome = Run("--out out --set effects.jet_thrust.runaway=0.02");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("jet_thrust ran away at t = 0."), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  EXPECT_EQ(
      FilesIn(folder_ / "out.partial"),
      (std::set<std::string>{"solver.csv", "summary.json", "telemetry.lcmlog", "trajectory.csv"}));
  const auto summary = ReadJson(folder_ / "out.partial/summary.json");
  EXPECT_EQ(summary.at("complete"), false);
  EXPECT_LT(summary.at("sim_time_s"), 1.0);
}

TEST_F(ClosedLoopRun, RefusesOptionsThatMeanNothingHere) {
  const std::string steer = "run " + Scene("steer"), paper = "run " + Scene("paper");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {paper + " --bus loop", "--bus: is for a closed loop, must be with a scene that has a table"},
      {steer + " --open-loop --realtime", "--realtime: is for a closed loop, must be with --open"},
      {steer + " --model reduced --controller gait", "--controller: is for a closed loop"},
      {steer + " --stop-at 1", "a closed loop has no checkpoints"},
      {steer + " --controller best", "--controller"},
      {steer + " --bus token-ring", "bus 'token-ring'"},
      {steer + " --bus can:nowhere9", "nowhere9"},
      {steer + " --record no/such/folder/bus.log", "no/such/folder/bus.log"},
      {steer + " --lcm tcp://somewhere", "--lcm: tcp://somewhere: must be udpm://"},
  };
  for (const auto& [arguments, told] : cases) {
    const Outcome outcome = Mantle(folder_, arguments + " --out out");
    EXPECT_EQ(outcome.status, 2) << arguments;
    EXPECT_NE(outcome.err.find(told), std::string::npos) << arguments << "\n" << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out.partial")) << arguments;
  }
}

}  // namespace
}  // namespace mantle::testing_tools
