#include "loop/vehicle_side.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "loop/closed_loop.h"
#include "loop/scene/scene.h"
#include "tests/support/paths.h"
#include "tests/support/refusal.h"

// The seam at the far end of the wire: a vehicle of a user's own takes the plant's place.

namespace mantle::loop {
namespace {

using tests::Refusal;

scene::Scene Reach(const std::string& vehicle) {
  return scene::LoadScene(tests::SourcePath("scenes/reach.toml"),
                          {"time.duration=0.6", "drives.vehicle=\"" + vehicle + "\""});
}

/// A user's own that has a plant inside: all that the loop may know of it goes through the seam.
class Wrapped final : public VehicleSide {
 public:
  Wrapped(const VehicleParts& parts, const scene::Scene& scene)
      : plant_(PlantRobot(scene)),
        model_(scene.robot, scene.reduction),
        vehicle_(plant_, model_, scene.run, parts.motors, parts.drives, parts.sensors, parts.bus) {}

  void Pump(std::int64_t now_us) override { vehicle_.Pump(now_us); }
  void Hold(std::int64_t now_us) override { vehicle_.Hold(now_us); }
  void Release(std::int64_t now_us) override { vehicle_.Release(now_us); }
  Status Advance(std::int64_t now_us) override {
    if (now_us > fails_us) return {false, "it tore"};
    return vehicle_.Advance(now_us);
  }
  int coupling_steps() const override { return vehicle_.coupling_steps(); }
  bool braked() const override { return vehicle_.braked(); }
  Status Look(double time_s) override { return vehicle_.Look(time_s); }
  void Measure(Sensors* message) override { vehicle_.Measure(message); }
  const reduced::ReducedState& truth() const override { return vehicle_.truth(); }
  const model::VectorX& tension_n() const override { return vehicle_.tension_n(); }
  model::Vector3 tip(int arm) const override { return vehicle_.tip(arm); }
  double cable_work_j(int motor) const override { return vehicle_.cable_work_j(motor); }

  static inline std::int64_t fails_us = std::numeric_limits<std::int64_t>::max();

 private:
  model::Plant plant_;
  reduced::ReducedPlant model_;
  PlantVehicle vehicle_;
};

void RegisterWrapped(const std::string& name) {
  RegisterVehicle({name, [](const VehicleParts& parts) {
                     return std::make_unique<Wrapped>(parts, Reach("plant"));
                   }});
}

TEST(VehicleSide, OneOfAUsersOwnGetsTheSameCommandsAsThePlantInItsPlace) {
  RegisterWrapped("wrapped");
  const auto commands = [](const std::string& vehicle, LoopResult* result) {
    std::vector<model::VectorX> all;
    ClosedLoop loop(Reach(vehicle));
    *result = loop.Run([&](const LoopStep& step) {
      all.push_back(step.command_n);
      EXPECT_EQ(step.plant != nullptr, vehicle == "plant");
      return true;
    });
    return all;
  };
  LoopResult ours, theirs;
  EXPECT_EQ(commands("plant", &ours), commands("wrapped", &theirs));
  ASSERT_TRUE(theirs.ok) << theirs.reason;
  EXPECT_EQ(theirs.cost, ours.cost);
  EXPECT_EQ(theirs.mean_error, ours.mean_error);
  EXPECT_EQ(theirs.cable_work_j, ours.cable_work_j);
  EXPECT_EQ(theirs.traffic.frames, ours.traffic.frames);
}

TEST(VehicleSide, ItsFailureEndsTheRunWithItsReasonAndTheDrivesStopped) {
  RegisterWrapped("torn");
  ClosedLoop loop(Reach("torn"));
  bool first = true;
  const LoopResult result = loop.Run([&](const LoopStep& step) {
    if (step.time_s > 0.2 && first) {
      Wrapped::fails_us = 0;
      first = false;
    }
    return true;
  });
  Wrapped::fails_us = std::numeric_limits<std::int64_t>::max();
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.reason, "it tore");
  EXPECT_NEAR(result.time_s, 0.21, 1e-9);
}

TEST(VehicleSide, NamesAreKnownOrRefusedWithTheKnownOnes) {
  EXPECT_EQ(VehicleNames().front(), kPlantVehicle);
  EXPECT_NE(Refusal([] { Reach("raft"); }).find("drives.vehicle"), std::string::npos);
  EXPECT_NE(
      Refusal([] { FindVehicle("raft"); }).find("no vehicle is called \"raft\"; known: plant"),
      std::string::npos);
  EXPECT_NE(Refusal([] { RegisterWrapped("plant"); }).find("taken"), std::string::npos);
}

TEST(VehicleSide, WhatIsNoPlantHasNone) {
  RegisterWrapped("raft");
  ClosedLoop loop(Reach("raft"));
  EXPECT_THROW(loop.plant_side(), std::logic_error);
}

}  // namespace
}  // namespace mantle::loop
