#include "reduced/reduced_model.h"

#include <gtest/gtest.h>

#include "reduced/build/simulation.h"
#include "tests/reduced/reduced_robots.h"

namespace mantle::reduced {
namespace {

using Kind = ActuatorTarget::Kind;

model::Robot Vehicle() { return tests::ControlRobot(8, 24); }

void Refused(const model::Robot& robot, const Reduction& r, const std::string& says) {
  try {
    ReducedPlant(robot, r);
    ADD_FAILURE() << "accepted: " << says;
  } catch (const model::BadRobot& error) {
    EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
  }
}

TEST(ReducedModel, RefusesWhatCannotBeWithNameValueAndBound) {
  model::Robot frozen = Vehicle();
  frozen.coupling = model::Coupling::kFrozen;
  Refused(frozen, {}, "robot.coupling = \"frozen\"");
  Reduction r;
  r.arms.resize(3);
  Refused(Vehicle(), r, "reduced.arms: 3 entries, must be 1 or the number of arms, 1");
  const auto arm = [&](auto change, const std::string& says) {
    Reduction bad;
    change(&bad.arms[0]);
    Refused(Vehicle(), bad, "reduced.arms.arm." + says);
  };
  arm([](ArmReduction* a) { a->segments = 0; }, "segments = 0");
  arm([](ArmReduction* a) { a->segments = -1; }, "segments = -1");
  arm([](ArmReduction* a) { a->segment_ends_m = {0.1, 0.1, 0.42}; }, "segment_ends");
  arm([](ArmReduction* a) { a->segment_ends_m = {0.2, 0.1, 0.42}; }, "segment_ends");
  arm([](ArmReduction* a) { a->segment_ends_m = {0.0, 0.42}; }, "segment_ends");
  arm([](ArmReduction* a) { a->segment_ends_m = {0.2, 0.5}; }, "segment_ends");
  arm([](ArmReduction* a) { a->segment_ends_m = {std::nan(""), 0.42}; }, "segment_ends");
  arm([](ArmReduction* a) { a->strains = {}; }, "strains: none");
  arm([](ArmReduction* a) { a->points = 0; }, "points = 0, must be in [1, 32]");
  arm([](ArmReduction* a) { a->points = 33; }, "points = 33, must be in [1, 32]");
  arm(
      [](ArmReduction* a) {
        a->basis = BasisKind::kLegendre;
        a->degree = -1;
      },
      "degree = -1");
}

TEST(ReducedModel, RefusesMoreMantleCoordinatesThanItsNodesHave) {
  Reduction r;
  r.mantle.modes = 3;
  r.mantle.static_pressures_pa = {50, 100, 150, 200, 250, 300};
  Refused(Vehicle(), r,
          "reduced.modes = 3, 6 static shapes and 0 snapshots: 9 coordinates, must be in [1, 8]");
  r.mantle.static_pressures_pa.emplace();
  r.mantle.modes = 0;
  Refused(Vehicle(), r, "0 coordinates, must be in [1, 8]");
}

TEST(ReducedModel, RefusesActuatorsWithoutATarget) {
  for (Kind kind :
       {Kind::kCable, Kind::kDistributed, Kind::kPoint, Kind::kStrip, Kind::kNormalPressure}) {
    for (int index : {-1, 17}) {
      Reduction r;
      r.actuators = {{"motor", {{kind, index, 1.0}}}};
      Refused(Vehicle(), r, "reduced.actuators.motor: index = " + std::to_string(index));
    }
  }
  Reduction r;
  r.actuators = {{"motor", {}}};
  Refused(Vehicle(), r, "reduced.actuators.motor: drives nothing");
}

TEST(ReducedModel, StateOfTheWrongSizeIsNamedWithItsSizes) {
  const ReducedPlant model(Vehicle(), {});
  ReducedState s = InitialState(model);
  EXPECT_EQ(SizeComplaint(model, s), "");
  s.q.resize(3);
  EXPECT_EQ(SizeComplaint(model, s), "q has 3 entries, must be 19");
  s = InitialState(model);
  s.v.resize(99);
  EXPECT_EQ(SizeComplaint(model, s), "v has 99 entries, must be 25");
  ReducedSimulation simulation(model, {});
  simulation.mutable_state()->q.resize(3);
  const model::StepStatus status = simulation.AdvanceTo(1.0);
  EXPECT_FALSE(status.ok);
  EXPECT_NE(status.reason.find("state: q has 3 entries, must be 19"), std::string::npos)
      << status.reason;
}

TEST(ReducedModel, ArmsMayBeReducedDifferently) {
  model::Robot robot = Vehicle();
  robot.arms.push_back(robot.arms[0]);
  robot.arms[1].name = "second";
  Reduction r;
  r.arms.resize(2);
  r.arms[0].segments = 2;
  r.arms[1].basis = BasisKind::kLegendre;
  r.arms[1].degree = 1;
  r.arms[1].strains = kSixStrains;
  const ReducedPlant model(robot, r);
  EXPECT_EQ(model.arms[0].size(), 8);
  EXPECT_EQ(model.arms[1].size(), 12);
  EXPECT_EQ(model.arm_first(1), 8);
  EXPECT_EQ(model.mantle_first(), 20);
}

TEST(ReducedModel, GangedCablesShareOneInput) {
  Reduction r;
  r.actuators = {{"pair", {{Kind::kCable, 0, 1.0}, {Kind::kCable, 2, 0.5}}}};
  const ReducedPlant model(Vehicle(), r);
  ASSERT_EQ(model.input_count(), 1);
  model::PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  inputs.cables[1].tension_n = 0.2;
  const double u = 0.4;
  ApplyControls(model, &u, &inputs);
  EXPECT_EQ(inputs.cables[0].tension_n, 0.4);
  EXPECT_EQ(inputs.cables[2].tension_n, 0.2);
  EXPECT_EQ(inputs.cables[1].tension_n, 0.2) << "not driven";
}

}  // namespace
}  // namespace mantle::reduced
