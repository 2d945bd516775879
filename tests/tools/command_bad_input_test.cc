#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>

#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

constexpr int kBadInput = 2;

struct Refusal {
  const char* what;
  std::string arguments;
  const char* says;  ///< part of the line
};

std::string PaperWith(const std::string& rest) {
  return "run " + Scene("paper") + " --out out " + rest;
}

std::string ReducedWith(const std::string& rest) { return PaperWith("--model reduced " + rest); }

TEST(BadInput, IsRefusedInOneLineAndWritesNothing) {
  const std::vector<Refusal> refusals = {
      {"unknown key", PaperWith("--set time.stepp=1"),
       "paper.toml: time.stepp: unknown key, did you mean \"step\"?"},
      {"wrong type", PaperWith("--set time.step=true"),
       "time.step: true: must be a number >= 1e-09"},
      {"wrong unit", PaperWith("--set 'time.step=5 mm'"),
       "time.step: \"5 mm\": must be a number >= 1e-09 with unit s, ms"},
      {"negative", PaperWith("--set arms.arm.length=-0.4"), "arms[0].length: -0.4 m: must be > 0"},
      {"not a number", PaperWith("--set time.duration=nan"),
       "time.duration: nan s: must be finite and in [1e-09, 1000000000]"},
      {"a step by which time never advances", PaperWith("--set time.step=1e-300"),
       "time.step: 1e-300 s: must be >= 1e-09"},
      {"more steps than time can count", PaperWith("--set time.duration=1e9 --set time.step=1e-9"),
       "time.step: 1e-09: 1e+18 steps in `duration`, 1000000000 s: must be at most 1e+12"},
      {"rows without end", PaperWith("--set output.interval=1e-300"),
       "output.interval: 1e-300 s: must be >= 1e-09"},
      {"a halved step without end", PaperWith("--set time.min_step=1e-300"),
       "time.min_step: 1e-300 s: must be in [1e-09,"},
      {"break points without end",
       PaperWith("--set 'arms.arm.cables=[{fraction = 0.5, tension = {type = \"triangular\", high "
                 "= 1, period = 1e-300}}]'"),
       "tension.period: 1e-300 s: must be >= 1e-09"},
      {"a reduced step without end", ReducedWith("--set reduced.step=1e-300"),
       "reduced.step: 1e-300 s: must be >= 1e-09"},
      {"cable outside section",
       PaperWith("--set 'arms.arm.cables=[{fraction = 1.5, tension = 1}]'"),
       "arms[0].cables[0].fraction: 1.5: must be in [0, 1]"},
      {"mesh too coarse", PaperWith("--set mantle.elements=3"),
       "paper.toml: mantle.elements = 3, must be >= 4"},
      {"contradictory effects",
       PaperWith("--set effects.lateral_drag=true --set robot.root=clamped "
                 "--set robot.coupling=frozen"),
       "robot.coupling: \"frozen\": must be \"exact\""},
      {"unstable explicit step", PaperWith("--set time.integrator=rk4"),
       "s: explicit RK4 is stable up to about"},
      {"missing scene", "run absent.toml --out out", "absent.toml: cannot be read: no such file"},
      {"no scene", "run --out out", "SCENE"},
      {"unknown option", PaperWith("--fast"), "--fast"},
      {"no command", "", "subcommand"},
      {"override that is none", PaperWith("--set time.step"), "--set time.step: must be key=value"},
      {"no [time]", "run " + Scene("elastica") + " --out out", "time: table is missing"},
      {"statics of a free root", "static " + Scene("paper") + " --out out",
       "robot.root: must be \"clamped\""},
      {"resume of nothing", PaperWith("--resume absent"), "--resume: absent: cannot be read"},
      {"checkpoints of CVODE", PaperWith("--set time.integrator=cvode --checkpoint-every 1"),
       "--checkpoint-every: needs another integrator than cvode"},
      {"unknown model", PaperWith("--model slow"), "--model: slow"},
      {"strains that are none", ReducedWith("--set reduced.strains=seven"),
       "paper.toml: reduced.strains: \"seven\": must be one of \"bending\""},
      {"no segments", ReducedWith("--set reduced.segments=0"),
       "paper.toml: reduced.segments: 0: must be a whole number in [1, 1000]"},
      {"segment of zero length", ReducedWith("--set 'reduced.segment_ends=[0.1, 0.1, 0.42]'"),
       "segment_ends = 0.1 m: a segment of 0 m, must be longer than"},
      {"segments beyond the arm", ReducedWith("--set 'reduced.segment_ends=[0.1, 0.5]'"),
       "segment_ends: the last one = 0.5 m, must be the arm's length 0.42 m"},
      {"more strains than elements", ReducedWith("--set reduced.segments=41"),
       "paper.toml: reduced.arms.arm: 164 strain coordinates; the plant's 20 elements"},
      {"more mantle coordinates than fit", ReducedWith("--set reduced.modes=8"),
       "paper.toml: reduced.modes = 8, 1 static shapes and 1 snapshots: 10 coordinates, must be in "
       "[1, 8]"},
      {"mantle coordinates out of bound",
       "run --model reduced " + Scene("mantle_swim") +
           " --out out --set mantle.elements=4 --set mantle.grading=1 --set reduced.modes=20",
       "reduced.modes: 20: must be a whole number in [0, 8]"},
      {"static shape beyond the collapse", ReducedWith("--set 'reduced.static_pressures=[600]'"),
       "static_pressures = 600 Pa: no stable equilibrium"},
      {"unknown key of the reduction", ReducedWith("--set reduced.segment=3"),
       "reduced.segment: unknown key, did you mean \"segments\"?"},
      {"motor without a cable",
       ReducedWith("--set 'reduced.actuators=[{drives = [{cable = \"arm.left\"}]}]'"),
       "reduced.actuators[0].drives[0].cable: \"arm.left\": must be one of: none in this scene"},
      {"reduced step", ReducedWith("--set reduced.step=0"), "reduced.step: 0 s: must be >= 1e-09"},
      {"checkpoints of the reduced model", ReducedWith("--checkpoint-every 1"),
       "--model reduced: has no checkpoints"},
      {"frozen coupling, reduced", "compare " + Scene("paper_frozen") + " --out out",
       "paper_frozen.toml: robot.coupling = \"frozen\": the reduced model has exact coupling only"},
      {"compare of statics", "compare " + Scene("elastica") + " --out out",
       "time: table is missing: `mantle compare` needs [time]"},
      {"check of a wrong scene", "check " + Scene("paper") + " --set water.density=-1",
       "water.density: -1 kg/m^3: must be > 0"},
  };
  const auto folder = FreshFolder("bad_input");
  for (const Refusal& refusal : refusals) {
    const Outcome outcome = Mantle(folder, refusal.arguments);
    SCOPED_TRACE(refusal.what);
    EXPECT_EQ(outcome.status, kBadInput);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(refusal.says), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.rfind("mantle: ", 0), 0u) << outcome.err;
    EXPECT_TRUE(std::filesystem::is_empty(folder)) << "something was written";
  }
}

TEST(BadInput, EmptyBodiesAreRefused) {
  const auto folder = FreshFolder("empty_bodies");
  std::ofstream(folder / "empty.toml") << "[time]\nduration = 1\n";
  std::ofstream(folder / "broken.toml") << "[time\nduration = 1\n";
  const Outcome empty = Mantle(folder, "run empty.toml --out out");
  EXPECT_EQ(empty.status, kBadInput);
  EXPECT_NE(empty.err.find("empty.toml: arms: the scene has no bodies"), std::string::npos)
      << empty.err;
  const Outcome broken = Mantle(folder, "run broken.toml --out out");
  EXPECT_EQ(broken.status, kBadInput);
  EXPECT_NE(broken.err.find("broken.toml: line 1"), std::string::npos) << broken.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(BadInput, AnOutputThatCannotBeWrittenIsRefusedBeforeTheRun) {
  const auto folder = FreshFolder("unwritable");
  std::ofstream(folder / "file") << "not a folder\n";
  for (const std::string& command :
       {"run " + Scene("arm_dynamic"), "static " + Scene("elastica")}) {
    const Outcome outcome = Mantle(folder, command + " --out file/results");
    EXPECT_EQ(outcome.status, kBadInput);
    EXPECT_EQ(outcome.err,
              "mantle: --out: file/results: cannot be written: must be a folder with write "
              "permission\n");
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_EQ(ReadFile(folder / "file"), "not a folder\n");
}

TEST(BadInput, WhatIsNoRegularFileIsRefusedAtOnce) {
  const auto folder = FreshFolder("no_regular_file");
  mkfifo((folder / "fifo").c_str(), 0600);
  std::ofstream(folder / "base.toml") << "extends = \"fifo\"\n";
  std::ofstream(folder / "big.toml").seekp(64 << 20) << "x";  // sparse
  struct Case {
    std::string arguments, says;
  };
  const std::string bus = " --bus udp:239.74.163.2:43113@lo";
  for (const auto& [arguments, says] : std::initializer_list<Case>{
           {"check fifo", "fifo: cannot be read: is no regular file"},
           {"check /dev/zero", "/dev/zero: cannot be read: is no regular file"},
           {"check /dev/stdin </dev/zero", "/dev/stdin: cannot be read: is no regular file"},
           {"check -", "-: cannot be read: standard input is not taken: must be a file"},
           {"check .", ".: cannot be read: is no regular file"},
           {"check base.toml", "fifo: cannot be read: is no regular file"},
           {"check big.toml", "big.toml: cannot be read: 67108865 bytes, must be at most 67108864"},
           {"run fifo --out out", "fifo: cannot be read: is no regular file"},
           {"static /dev/zero --out out", "/dev/zero: cannot be read: is no regular file"},
           {"compare fifo --out out", "fifo: cannot be read: is no regular file"},
           {"tune fifo --out out", "fifo: cannot be read: is no regular file"},
           {"study control /dev/zero --out out", "/dev/zero: cannot be read: is no regular file"},
           {"run " + Scene("arm_dynamic") + " --out out --resume fifo",
            "--resume: fifo: cannot be read: is no regular file"},
           {"run " + Scene("arm_dynamic") + " --out out --resume /dev/zero",
            "--resume: /dev/zero: cannot be read: is no regular file"},
           {"bus play fifo" + bus, "log file 'fifo' cannot be read: is no regular file"},
           {"bus play /dev/zero" + bus, "log file '/dev/zero' cannot be read: is no regular file"},
           {"check " + Scene("paper") +
                " --set 'mantle.strips.muscle.pressure={type=\"table\", file=\"/dev/zero\"}'",
            "/dev/zero: cannot be read: is no regular file"},
       }) {
    const Outcome outcome = Mantle(folder, arguments);
    EXPECT_EQ(outcome.status, kBadInput) << arguments;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << arguments << "\n" << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace mantle::testing_tools
