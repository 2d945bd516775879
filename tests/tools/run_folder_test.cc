#include "tools/report/run_folder.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/tools/program.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/report/page_data.h"

namespace mantle::testing_tools {
namespace {

using namespace tools;

// An arm of three nodes with a cable of two points.
ShapeTelemetry SmallShape(std::int64_t utime) {
  ShapeTelemetry m;
  m.utime = utime;
  m.arm_name = {"arm"};
  m.arm_nodes = {3};
  m.arc_length = {0, 0.1, 0.2};
  m.position = {{0, 0, 0}, {0, 0, 0.1}, {0, 0, 0.2}};
  m.quaternion.assign(3, {1, 0, 0, 0});
  m.radius = {0.01F, 0.01F, 0.01F};
  m.strain.assign(2, {0, 0, 0, 1, 0, 0});
  m.stress.resize(2);
  m.cable_name = {"arm_a"};
  m.cable_points = {2};
  m.cable_tension = {1};
  m.cable_position = {{0, 0, 0}, {0, 0, 0.2F}};
  return m;
}

// What a folder with a run's log of these shapes reads as; empty where it is read.
std::string Refusal(const std::string& name, const std::vector<ShapeTelemetry>& shapes) {
  const auto folder = FreshFolder(name);
  std::ofstream(folder / "summary.json") << R"({"scene": "s", "complete": true})";
  auto link = OpenLcm({.log_folder = folder});
  for (const ShapeTelemetry& m : shapes) link->Write(m);
  link->FinishLog();
  try {
    const auto records = ReadRunFolder(folder);
    EXPECT_EQ(records.at(0).shapes.size(), shapes.size());
  } catch (const BadInput& error) {
    return error.what();
  }
  return "";
}

TEST(RunFolder, ReadsShapesBackAsTheyWereWritten) {
  EXPECT_EQ(Refusal("run_folder_good", {SmallShape(0), SmallShape(20'000)}), "");
}

TEST(RunFolder, ShapesWhoseListsDoNotFitTogetherAreRefused) {
  const std::vector<std::function<void(ShapeTelemetry*)>> faults = {
      [](ShapeTelemetry* m) { m->arm_nodes = {4}; }, [](ShapeTelemetry* m) { m->arm_nodes = {-3}; },
      [](ShapeTelemetry* m) { m->cable_points = {3}; },
      [](ShapeTelemetry* m) { m->cable_points = {0}; }};
  for (std::size_t i = 0; i < faults.size(); ++i) {
    ShapeTelemetry m = SmallShape(40'000);
    faults[i](&m);
    const std::string why = Refusal("run_folder_lists", {SmallShape(0), m});
    EXPECT_NE(why.find("MANTLE_SHAPE at utime 40000: its lists do not fit together"),
              std::string::npos)
        << i << why;
  }
}

TEST(RunFolder, AnotherRobotOrAnOlderShapeInTheSameLogIsRefused) {
  ShapeTelemetry other = SmallShape(1);
  other.arm_name = {"leg"};
  EXPECT_NE(Refusal("run_folder_robot", {SmallShape(0), other}).find("other bodies"),
            std::string::npos);
  EXPECT_NE(Refusal("run_folder_time", {SmallShape(5), SmallShape(4)}).find("is older"),
            std::string::npos);
}

TEST(PageData, LabelsOfRunsDiffer) {
  std::vector<RunRecord> records(4);
  records[0].label = records[1].label = records[2].label = "swim";
  records[0].folder = "a/swim";
  records[1].folder = records[2].folder = "b/swim";
  records[3].label = "turn";
  TellApart(&records);
  EXPECT_EQ(records[0].label, "a/swim");
  EXPECT_EQ(records[1].label, "b/swim");
  EXPECT_EQ(records[2].label, "b/swim (2)");
  EXPECT_EQ(records[3].label, "turn");
}

TEST(PageData, ShapesThatAreLeftOutCostWhatThePageSays) {
  // Three shapes, the middle one 5 mm off the line between the others: only two fit.
  RunRecord record;
  for (int i = 0; i < 3; ++i) {
    ShapeTelemetry m = SmallShape(1000 * i);
    m.position[2][0] = i == 1 ? 0.005 : 0.0;
    record.shapes.push_back(m);
  }
  // Many more, so that the fewest bytes that shapes get do not hold them all.
  for (int i = 3; i < 9001; ++i) record.shapes.push_back(SmallShape(1000 * i));
  PageOptions options;
  options.run_bytes = 1;
  const Json shape = PageData(std::vector<RunRecord>{record}, options)["runs"][0]["shape"];
  EXPECT_EQ(shape["of_frames"], 9001U);
  EXPECT_LT(shape["time"]["n"], 9001U);
  EXPECT_NEAR(shape["error_m"].get<double>(), 0.005, 1e-5);
}

}  // namespace
}  // namespace mantle::testing_tools
