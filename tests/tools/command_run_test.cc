#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/support/paths.h"
#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

// Short of the paper's scene, with everything in it: mantle, cone, arm, switching torque.
const char* const kShort =
    " --set time.duration=0.6 --set time.step=0.005 --set output.interval=0.02 --set "
    "'arms.arm.distributed.bend_z.schedule.off=[0.23]' "
    "--set mantle.elements=16 --set arms.arm.elements=6";

nlohmann::json WithoutWallTime(nlohmann::json summary) {
  summary.erase("wall_time_s");
  summary.erase("realtime_factor");
  return summary;
}

// The scene's mantle is squeezed far beyond the pressure of its lobes: a run says so, and no more.
void ExpectLobedBucklingAlone(const std::string& err) {
  EXPECT_EQ(err.rfind("mantle: warning: paper: mantle: ", 0), 0u) << err;
  EXPECT_NE(err.find("Pa inward, t = "), std::string::npos) << err;
  EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
}

TEST(MantleRun, FreeRodSpinsWithItsAngularMomentumWithAnyMesh) {
  // 20 kg, 2 m, 0.3 m thick at 1 rad/s about a transverse axis through its middle: m L^2 / 12 +
  // m r^2 / 4; the centre of mass stays.
  const double expected = 20.0 * (4.0 / 12 + 0.15 * 0.15 / 4);
  constexpr double kRelative = 1e-11;  // the density is given to 17 digits; 0.1 s of steps
  for (int elements : {1, 2, 4, 20}) {
    const auto folder = FreshFolder("run_free_rod");
    const Outcome outcome =
        Mantle(folder, "run '" + tests::SourcePath("tests/tools/run_cases/free_rod_inertia.toml") +
                           "' --out out --set arms.rod.elements=" + std::to_string(elements));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto rows = ReadCsv(folder / "out/trajectory.csv");
    const auto at = [&](const std::string& title) {
      const auto column = std::find(rows[0].begin(), rows[0].end(), title) - rows[0].begin();
      return std::stod(rows.at(1).at(column));
    };
    EXPECT_NEAR(at("angular_momentum_z_n_m_s"), expected, kRelative * expected) << elements;
    EXPECT_NEAR(at("momentum_y_n_s"), 0.0, kRelative * 20.0) << elements;
  }
}

TEST(MantleRun, WritesSummaryAndTrajectory) {
  const auto folder = FreshFolder("run");
  const Outcome outcome = Mantle(folder, "run " + Scene("paper") + kShort + " --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  ExpectLobedBucklingAlone(outcome.err);
  EXPECT_NE(outcome.out.find("results in out"), std::string::npos);
  std::set<std::string> files;
  for (const auto& f : std::filesystem::directory_iterator(folder / "out")) {
    files.insert(f.path().filename().string());
  }
  EXPECT_EQ(files, (std::set<std::string>{"summary.json", "telemetry.lcmlog", "trajectory.csv"}));

  const auto summary = ReadJson(folder / "out/summary.json");
  EXPECT_EQ(summary.at("scene"), "paper");
  EXPECT_EQ(summary.at("complete"), true);
  EXPECT_DOUBLE_EQ(summary.at("sim_time_s"), 0.6);
  EXPECT_GT(summary.at("wall_time_s"), 0.0);
  EXPECT_GT(summary.at("realtime_factor"), 0.0);
  EXPECT_GE(summary.at("steps"), 120);
  EXPECT_GT(summary.at("newton_iterations"), summary.at("steps").get<long>());
  EXPECT_LE(summary.at("power_balance_residual"), 1e-10);
  EXPECT_GT(summary.at("energy_drift"), 0.0);
  EXPECT_LT(summary.at("energy_drift"), 1e-2);
  EXPECT_EQ(summary.at("final").at("root").at("quaternion_wxyz").size(), 4u);
  EXPECT_EQ(summary.at("final").at("tips").at("arm").at("position_m").size(), 3u);
  EXPECT_LT(summary.at("volume_m3").at("min"), summary.at("volume_m3").at("initial").get<double>());
  EXPECT_TRUE(summary.at("work_j").contains("jet_thrust"));
  EXPECT_FALSE(summary.at("work_j").contains("roll_drag")) << "not named by the scene";
  EXPECT_TRUE(summary.at("energetic_index").contains("positive_ratio_of_means"));
  EXPECT_EQ(summary.at("settings").at("integrator"), "sdirk2");
  EXPECT_EQ(summary.at("overrides").size(), 6u);

  const auto rows = ReadCsv(folder / "out/trajectory.csv");
  ASSERT_EQ(rows.size(), 1u + 31u) << "titles, t = 0 and every 20 ms";
  for (const auto& row : rows) EXPECT_EQ(row.size(), rows[0].size());
  const auto column = [&](const std::string& title) {
    return std::find(rows[0].begin(), rows[0].end(), title) - rows[0].begin();
  };
  const auto z = column("root_z_m"), volume = column("volume_m3"), tip = column("arm_tip_x_m");
  ASSERT_LT(std::max({z, volume, tip}), static_cast<long>(rows[0].size()));
  EXPECT_DOUBLE_EQ(std::stod(rows.back()[0]), 0.6);
  EXPECT_EQ(std::stod(rows.back()[z]), summary["final"]["root"]["position_m"][2].get<double>());
  EXPECT_EQ(std::stod(rows.back()[tip]),
            summary["final"]["tips"]["arm"]["position_m"][0].get<double>());
  EXPECT_EQ(std::stod(rows.back()[volume]), summary["volume_m3"]["final"].get<double>());
}

TEST(MantleRun, SummaryNamesEveryEffectOfTheScene) {
  const auto folder = FreshFolder("run_effects");
  const Outcome outcome =
      Mantle(folder, "run " + Scene("vehicle") +
                         " --set time.duration=0.02 --out out --set effects.roll_drag=true "
                         "--set 'effects.magnetic_field={field=[0,0,1e-3],root_moment=[1,0,0]}'");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto summary = ReadJson(folder / "out/summary.json");
  const auto effects = summary.at("settings").at("effects").get<std::vector<std::string>>();
  for (const char* name : {"weight", "buoyancy", "roll_drag", "magnetic_field"}) {
    EXPECT_EQ(std::count(effects.begin(), effects.end(), name), 1) << name;
  }
  EXPECT_TRUE(summary.at("work_j").contains("magnetic.root"));
}

TEST(MantleRun, EveryTitleOfTheTrajectoryHasADocumentedStem) {
  const auto folder = FreshFolder("titles");
  const Outcome outcome =
      Mantle(folder, "run " + Scene("octopus") + " --set time.duration=0.02 --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::string page = ReadFile(tests::SourcePath("docs/outputs.md"));
  // Columns of arms and cables are documented with ARM, CABLE, MANTLE and SPOKES in place of names,
  // and vectors by their first or last component.
  for (const char* stem : {"time_s",         "root_x_m",           "root_qz",
                           "root_wx_rad_s",  "root_vz_m_s",        "ARM_tip_x_m",
                           "ARM_tip_vz_m_s", "centre_of_mass_x_m", "angular_momentum_x_n_m_s",
                           "momentum_x_n_s", "volume_m3",          "volume_rate_m3_s",
                           "thrust_n",       "kinetic_solid_j",    "kinetic_water_j",
                           "elastic_arms_j", "elastic_mantle_j",   "ARM_CABLE_length_m",
                           "index_output_w", "index_input_w",      "power_balance_residual"}) {
    EXPECT_NE(page.find(std::string("`") + stem + "`"), std::string::npos) << stem;
    std::string name = stem;
    if (name == "ARM_CABLE_length_m") name = "arm1_outer_length_m";
    if (name.rfind("ARM", 0) == 0) name = "arm1" + name.substr(3);
    const auto titles = ReadCsv(folder / "out/trajectory.csv")[0];
    EXPECT_EQ(std::count(titles.begin(), titles.end(), name), 1) << name;
  }
}

TEST(MantleRun, JsonIsTheSummaryAlone) {
  const auto folder = FreshFolder("json");
  const Outcome outcome =
      Mantle(folder, "run " + Scene("arm_dynamic") + " --set time.duration=0.1 --json --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out), ReadJson(folder / "out/summary.json"));
  EXPECT_EQ(outcome.err, "") << "no progress where standard error is no terminal";
}

TEST(MantleRun, ResumedRunHasTheSameBits) {
  const auto folder = FreshFolder("resume");
  const std::string run = "run " + Scene("paper") + kShort + " --shape-every 3";
  ASSERT_EQ(Mantle(folder, run + " --out whole").status, 0);
  const Outcome stopped = Mantle(folder, run + " --out part --stop-at 0.13");
  EXPECT_EQ(stopped.status, 0) << "it did what it was asked";
  EXPECT_NE(stopped.err.find("stopped by --stop-at at t = 0.14 s"), std::string::npos)
      << stopped.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "part.partial/trajectory.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder / "part.partial/summary.json"));
  EXPECT_FALSE(std::filesystem::exists(folder / "part"));
  const Outcome other = Mantle(
      folder, run.substr(0, run.size() - 1) + "2 --out part --resume part.partial/checkpoint");
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("--shape-every: 2, must be 3 as in the run"), std::string::npos);
  const Outcome resumed = Mantle(folder, run + " --out part --resume part.partial/checkpoint");
  ASSERT_EQ(resumed.status, 0) << resumed.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "part.partial"));
  EXPECT_EQ(ReadFile(folder / "part/trajectory.csv"), ReadFile(folder / "whole/trajectory.csv"));
  EXPECT_EQ(ReadFile(folder / "part/telemetry.lcmlog"),
            ReadFile(folder / "whole/telemetry.lcmlog"));
  EXPECT_EQ(WithoutWallTime(ReadJson(folder / "part/summary.json")),
            WithoutWallTime(ReadJson(folder / "whole/summary.json")));
}

TEST(MantleRun, ResumesElsewhereFromAPeriodicCheckpoint) {
  const auto folder = FreshFolder("periodic");
  const std::string run = "run " + Scene("paper") + kShort + " --checkpoint-every 0.25";
  ASSERT_EQ(Mantle(folder, run + " --out whole").status, 0);
  ASSERT_TRUE(std::filesystem::exists(folder / "whole/checkpoint"));
  ASSERT_EQ(Mantle(folder, run + " --out other --resume whole/checkpoint").status, 0);
  EXPECT_EQ(ReadFile(folder / "other/trajectory.csv"), ReadFile(folder / "whole/trajectory.csv"));
}

TEST(MantleRun, CheckpointsBelongToTheirScene) {
  const auto folder = FreshFolder("fingerprint");
  const std::string run = "run " + Scene("arm_dynamic");
  ASSERT_EQ(Mantle(folder, run + " --out out --stop-at 0.1").status, 0);
  const Outcome other =
      Mantle(folder, run + " --set time.step=0.005 --out out2 --resume out.partial/checkpoint");
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("is of another scene"), std::string::npos) << other.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out2"));
}

TEST(MantleRun, StepsThatLoseTheMotionAreWarnedOfAndFiguresNameTheirScale) {
  const auto folder = FreshFolder("lost");
  const std::string steps =
      " --set time.step=2 --set time.duration=20 --set output.interval=2 --set "
      "'time.integrator=\"backward_euler\"' --out out";
  const Outcome outcome = Mantle(folder, "run " + Scene("arm_vibration") + steps);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err.rfind("mantle: warning: arm_vibration: energy_drift = ", 0), 0u)
      << outcome.err;
  EXPECT_NE(outcome.err.find("halve time.step = 2 s"), std::string::npos) << outcome.err;
  const auto summary = ReadJson(folder / "out/summary.json");
  EXPECT_GT(summary.at("energy_drift"), 0.05);
  EXPECT_GT(summary.at("energy_drift_scale_j"), 0.0);
  EXPECT_GT(summary.at("power_balance_scale_w"), 0.0);
  ASSERT_EQ(summary.at("warnings").size(), 1u);
  EXPECT_NE(outcome.err.find(summary.at("warnings")[0].get<std::string>()), std::string::npos);
  for (const char* scale : {" W, energy drift ", " J\n"}) {
    EXPECT_NE(outcome.out.find(scale), std::string::npos) << outcome.out;
  }
}

TEST(MantleRun, ARunThatCannotContinueKeepsWhatItReached) {
  const auto folder = FreshFolder("runaway");
  // An earlier result is neither lost nor taken for this run's.
  std::filesystem::create_directories(folder / "out");
  std::ofstream(folder / "out/summary.json") << "{}\n";
  // The printed jet law runs away with the arm's mass on the root at 450 Pa (docs/scene.md,
  // effects).
  const Outcome outcome = Mantle(
      folder, "run " + Scene("paper") + " --set mantle.strips.muscle.pressure.high=450 --out out");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("jet_thrust ran away at t = 0."), std::string::npos) << outcome.err;
  // One line says why it stopped; warnings, a line each, say what else was seen.
  const std::string complaints = SaidOf(outcome.err).complaints;
  EXPECT_EQ(std::count(complaints.begin(), complaints.end(), '\n'), 1) << outcome.err;
  EXPECT_EQ(ReadFile(folder / "out/summary.json"), "{}\n");
  const auto summary = ReadJson(folder / "out.partial/summary.json");
  EXPECT_EQ(summary.at("complete"), false);
  EXPECT_LT(summary.at("sim_time_s"), 1.0);
  EXPECT_GT(ReadCsv(folder / "out.partial/trajectory.csv").size(), 5u);
}

TEST(MantleRun, AnInterruptEndsTheRunWithACheckpoint) {
  const auto folder = FreshFolder("interrupt");
  const std::string run = "run " + Scene("arm_dynamic") + " --set time.duration=1e5 --out out";
  // The shell waits for the first checkpoint, then interrupts the program.
  const Outcome outcome = Mantle(
      folder, run +
                  " --checkpoint-every 1 & p=$!; "
                  "while [ ! -e out.partial/checkpoint ] && kill -0 $p; do sleep 0.05; done; "
                  "kill -INT $p; wait $p");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_TRUE(std::filesystem::exists(folder / "out.partial/checkpoint"));
  EXPECT_EQ(ReadJson(folder / "out.partial/summary.json").at("reason"), "interrupted");
}

TEST(MantleRun, HelpTeaches) {
  const auto folder = FreshFolder("help");
  for (const char* command : {"run", "static", "check"}) {
    const Outcome outcome = Mantle(folder, std::string(command) + " --help");
    EXPECT_EQ(outcome.status, 0);
    EXPECT_NE(outcome.out.find(std::string("mantle ") + command + " scenes/"), std::string::npos)
        << "no example in the help of " << command;
    EXPECT_NE(outcome.out.find("--set"), std::string::npos);
  }
}

}  // namespace
}  // namespace mantle::testing_tools
