#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "tests/support/paths.h"
#include "tests/tools/program.h"

// What two outputs of a closed loop share they agree on, in the earth's frame: summary.json,
// trajectory.csv, the telemetry's channels.

namespace mantle::testing_tools {
namespace {

struct Case {
  const char *scene, *set;
};
void PrintTo(const Case& c, std::ostream* os) { *os << c.scene << " " << c.set; }

constexpr const char* kSteady = " --set 'effects.current=[0.03,0.05,0]'";
constexpr const char* kChanging =
    " --set 'effects.current={x={type=\"sine\",amplitude=0.05,frequency=1},"
    "y={type=\"sine\",offset=0.04,amplitude=0.02,frequency=0.5}}'";
// The telemetry's numbers are doubles, the table's are printed to the last digit; a reduced state's
// root comes through a projection.
constexpr double kSame = 1e-11;

using Columns = std::map<std::string, std::vector<double>>;

Columns ParseColumns(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> titles;
  Columns columns;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::size_t i = 0;
    const bool first = titles.empty();
    for (std::string cell; std::getline(cells, cell, ','); ++i) {
      if (first) {
        titles.push_back(cell);
      } else {
        char* end = nullptr;
        columns[titles.at(i)].push_back(std::strtod(cell.c_str(), &end));
      }
    }
  }
  return columns;
}

class OneFrame : public testing::TestWithParam<Case> {
 protected:
  std::filesystem::path folder_ = FreshFolder(
      std::string("one_frame_") + std::to_string(testing::UnitTest::GetInstance()->random_seed()));

  Columns Channel(const std::string& name) {
    const Outcome o = Mantle(folder_, "log out/telemetry.lcmlog --channel " + name + " --csv");
    EXPECT_EQ(o.status, 0) << o.err;
    return ParseColumns(o.out);
  }
};
INSTANTIATE_TEST_SUITE_P(Scenes, OneFrame,
                         testing::Values(Case{"steer", ""}, Case{"steer", kSteady},
                                         Case{"steer", kChanging}, Case{"reach", kSteady},
                                         Case{"reach", kChanging}));

TEST_P(OneFrame, SummaryTelemetryAndTrajectoryAgree) {
  const Case c = GetParam();
  const bool steers = std::string_view(c.scene) == "steer";
  // Every SYNC is a sample, so that least distances are those of the samples.
  const Outcome outcome =
      Mantle(folder_, "run " + Scene(c.scene) +
                          " --set time.duration=0.8 --set "
                          "output.interval=0.01 --set arms.arm.elements=8" +
                          (steers ? " --set mantle.elements=16" : "") + c.set + " --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto summary = ReadJson(folder_ / "out/summary.json");
  const auto& control = summary.at("control");
  const Columns t = ParseColumns(ReadFile(folder_ / "out/trajectory.csv"));
  const Columns state = Channel("MANTLE_STATE"), reduced = Channel("MANTLE_REDUCED_STATE"),
                plan = Channel("MANTLE_PLAN");
  const std::size_t rows = t.at("time_s").size();
  ASSERT_EQ(rows, 81U);
  const auto near = [&](const Columns& a, const std::string& x, const Columns& b,
                        const std::string& y) {
    ASSERT_TRUE(a.contains(x)) << x;
    ASSERT_TRUE(b.contains(y)) << y;
    ASSERT_EQ(a.at(x).size(), b.at(y).size());
    for (std::size_t i = 0; i < a.at(x).size(); ++i) {
      ASSERT_NEAR(a.at(x)[i], b.at(y)[i], kSame) << x << " " << y << " row " << i;
    }
  };
  const char* axes[] = {"x", "y", "z"};
  std::vector<std::vector<double>> root(3), velocity(3);
  for (int k = 0; k < 3; ++k) {
    const std::string axis = axes[k], i = std::to_string(k);
    near(t, "root_" + axis + "_m", state, "root_position_" + i);
    near(t, "root_" + axis + "_m", reduced, "root_position_" + i);
    near(t, "root_w" + axis + "_rad_s", reduced, "v_" + i);
    near(t, "root_v" + axis + "_m_s", reduced, "v_" + std::to_string(k + 3));
    near(t, "root_v" + axis + "_m_s", state, "root_twist_" + std::to_string(k + 3));
    near(t, "arm_tip_" + axis + "_m", state, "tip_position_0_" + i);
    root[k] = t.at("root_" + axis + "_m");
    const double last = summary.at("final").at("root").at("position_m").at(k);
    EXPECT_NEAR(root[k].back(), last, kSame);
    if (!steers) {
      EXPECT_NEAR(root[k].back(), root[k].front(), kSame) << "it is clamped";
    }
  }
  const auto distance = [&](std::size_t row, const std::array<double, 3>& to,
                            const std::string& of) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      sum += std::pow(t.at(of + axes[k] + "_m")[row] - to[static_cast<std::size_t>(k)], 2);
    }
    return std::sqrt(sum);
  };
  const std::string what = steers ? "root_" : "arm_tip_",
                    error = steers ? "error_position_m" : "error_tip_m",
                    reference = steers ? "reference_" : "reference_tip_";
  for (std::size_t row = 0; row < rows; ++row) {
    std::array<double, 3> to{};
    for (std::size_t k = 0; k < 3; ++k) to[k] = t.at(reference + axes[k] + "_m")[row];
    ASSERT_NEAR(t.at(error)[row], distance(row, to, what), kSame);
  }
  EXPECT_NEAR(t.at(error).back(), control.at("error").at("final"), kSame);
  if (steers) {
    const auto at = control.at("waypoints").at(0).at("at_m");
    double least = 1e9;
    for (std::size_t row = 0; row < rows; ++row) {
      least = std::min(least, distance(row, {at[0], at[1], at[2]}, what));
    }
    EXPECT_NEAR(control.at("waypoints").at(0).at("distance_m"), least, kSame);
  }
  // A plan begins a delay after its time, where the vehicle will be.
  const std::size_t every = 5;  // SYNCs between plans
  const std::vector<double>& begins = plan.at("time_0");
  constexpr double kNear_m = 2e-3;
  for (std::size_t i = 0; i < begins.size(); ++i) {
    const std::size_t row = every * i + static_cast<std::size_t>(std::lround(100 * begins[i]));
    if (row >= rows) break;
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      ASSERT_NEAR(plan.at("root_position_0_" + std::to_string(k))[i], root[axis][row], kNear_m)
          << i;
    }
  }
}

}  // namespace
}  // namespace mantle::testing_tools
