#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

using Rows = std::vector<std::map<std::string, double>>;

// MANTLE_CONTROL of a run, by the names of its fields; texts are 0.
Rows ControlRows(const std::string& folder_name, const std::string& run) {
  const auto folder = FreshFolder(folder_name);
  EXPECT_EQ(Mantle(folder, "run " + run + " --out out").status, 0);
  std::istringstream in(
      Mantle(folder, "log out/telemetry.lcmlog --channel MANTLE_CONTROL --csv").out);
  Rows rows;
  std::vector<std::string> titles;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::vector<std::string> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    if (titles.empty()) {
      titles = row;
      continue;
    }
    rows.emplace_back();
    for (std::size_t i = 0; i < row.size(); ++i) {
      rows.back()[titles[i]] = row[i].starts_with('"') ? 0.0 : std::stod(row[i]);
    }
  }
  return rows;
}

std::string Indexed(const char* name, int i) { return name + ("_" + std::to_string(i)); }

TEST(ControlTelemetry, AnObserversPositionIsMostlyWithinThreeOfTheDeviationsThatItTells) {
  const Rows rows = ControlRows(
      "control_noise", Scene("steer_noise") + " --controller pursuit --set time.duration=3");
  ASSERT_GT(rows.size(), 100U);
  ASSERT_EQ(rows[0].count("deviation_5"), 1U);
  constexpr double kShare = 0.9;  // 0.997 were errors normal and white; the model's are neither
  for (int k = 3; k < 6; ++k) {   // x, y, z
    int within = 0, there = 0;
    for (const auto& row : rows) {
      const double sigma = row.at(Indexed("deviation", k));
      ASSERT_GT(sigma, 0);
      within += std::abs(row.at(Indexed("estimate_error", k))) < 3 * sigma ? 1 : 0;
      there += row.at(Indexed("estimate_error", k)) != 0 ? 1 : 0;
    }
    EXPECT_GT(within, kShare * static_cast<double>(rows.size())) << k;
    EXPECT_GT(there, 0.9 * static_cast<double>(rows.size())) << "noise makes errors: " << k;
  }
}

TEST(ControlTelemetry, WithoutAnObserverNoDeviationIsTold) {
  const Rows rows = ControlRows("control_plain",
                                Scene("steer") + " --controller pursuit --set time.duration=0.3");
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows[0].count("deviation_0"), 0U);
  EXPECT_EQ(rows[0].count("estimate_error_0"), 1U);
}

TEST(ControlTelemetry, ReferenceAndErrorAreThoseOfTheTrajectory) {
  const Rows rows = ControlRows("control_reference",
                                Scene("steer") + " --controller pursuit --set time.duration=0.3");
  const auto table = ReadCsv(std::filesystem::path(tests::BinaryPath("tests")) /
                             "work/control_reference/out/trajectory.csv");
  ASSERT_EQ(rows.size(), table.size() - 1);
  const auto& titles = table[0];
  const auto column = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(titles.begin(), titles.end(), name) - titles.begin());
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto cell = [&](const std::string& name) {
      return std::stod(table[i + 1][column(name)]);
    };
    EXPECT_EQ(rows[i].at("reference_2"), cell("reference_z_m"));
    EXPECT_EQ(rows[i].at("error"), cell("error_position_m"));
    EXPECT_EQ(rows[i].at("commanded_tension_0"), cell("command_mantle_n"));
    EXPECT_EQ(rows[i].at("actual_tension_0"), cell("actual_mantle_n"));
  }
}

}  // namespace
}  // namespace mantle::testing_tools
