#include <gtest/gtest.h>

#include "loop/scene/scene.h"

/// The keys of what an arm may be made of and carry: that they arrive, and that what contradicts
/// itself is refused by name.

namespace mantle::scene {

using namespace model;
namespace {

constexpr const char* kArm = R"(
[robot]
root = "clamped"
[[arms]]
name = "arm"
length = "300 mm"
elements = 12
material = { young = "1 MPa", density = 1100 }
pieces = [
  { length = "100 mm", radius = ["10 mm", "8 mm"], inner_radius = "4 mm" },
  { length = "50 mm", radius = "8 mm", rigid = true },
  { length = "150 mm", width = "10 mm", height = ["6 mm", "4 mm"] },
]
muscles = [{ amplitude = 1e-3, wave_length = "200 mm", frequency = 1 }]
payloads = [{ name = "stone", mass = "20 g", at = "150 mm", drop = 0.5 }]
[effects]
weight = true
[time]
duration = 1
)";

Scene Read(const std::vector<std::string>& overrides) {
  return ParseScene(kArm, "s.toml", ".", overrides);
}

std::string Message(const std::vector<std::string>& overrides) {
  try {
    const Plant plant(Read(overrides).robot);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(ArmOptions, ArriveInSi) {
  const Scene scene = Read(
      {"arms.arm.muscles[0].axis=[0, 2, 0]",
       "arms.arm.muscles[0].envelope=[{at = \"0 mm\", factor = 0}, {at = \"300 mm\", factor = 2}]",
       "arms.arm.distributed=[{force = [0, 1, 0], frame = \"world\", source = \"internal\"}]",
       "robot.initial=\"static\"", "arms.arm.initial_modes=[{mode = 2, speed = \"5 cm/s\"}]",
       "statics.load_steps=7"});
  const Arm& arm = scene.robot.arms.at(0);
  ASSERT_EQ(arm.pieces.size(), 3u);
  EXPECT_EQ(std::get<RoundOutline>(arm.pieces[0].outline).radius_m.tip, 0.008);
  EXPECT_EQ(std::get<RoundOutline>(arm.pieces[0].outline).inner_radius_m.base, 0.004);
  EXPECT_TRUE(arm.pieces[1].rigid);
  EXPECT_EQ(std::get<RectangularOutline>(arm.pieces[2].outline).height_m.tip, 0.004);
  EXPECT_EQ(arm.pieces[2].material.young_pa, 1e6) << "the arm's";
  EXPECT_EQ(arm.muscles.at(0).axis, Vector3::UnitY());
  EXPECT_EQ(arm.muscles.at(0).envelope.at(1).at_m, 0.3);
  EXPECT_EQ(arm.payloads.at(0).mass_kg, 0.02);
  EXPECT_EQ(arm.payloads.at(0).drop_s, 0.5);
  EXPECT_EQ(arm.distributed.at(0).internal, true);
  EXPECT_EQ(arm.initial_modes.at(0).number, 2);
  EXPECT_EQ(scene.robot.initial, InitialShape::kEquilibrium);
  EXPECT_EQ(scene.run.statics.load_steps, 7) << "the settings of a start from an equilibrium";
}

TEST(ArmOptions, ALoadOfZeroIsNoError) {
  EXPECT_EQ(Message({"arms.arm.points=[{force = [0, 0, 0]}]"}), "");
  EXPECT_EQ(Message({"arms.arm.distributed=[{moment = [0, 0, 0]}]"}), "");
  EXPECT_NE(Message({"arms.arm.points=[{}]"}), "");
}

TEST(ArmOptions, SchedulesAndCurrentsInTimeArrive) {
  const Scene scene = Read(
      {"effects.current={ y = { type = \"cubic\", time = [0, 1], value = [0, \"30 cm/s\"] } }",
       "arms.arm.muscles[0].amplitude={ type = \"pulse\", high = 2e-3, period = 0.5, rise = 0.1, "
       "hold = 0.1, fall = 0.2 }"});
  ASSERT_TRUE(scene.robot.effects.unsteady_current);
  EXPECT_NEAR(Value(scene.robot.effects.unsteady_current->y_m_s, 0.5), 0.15, 1e-12);
  EXPECT_NEAR(Value(scene.robot.arms[0].muscles[0].amplitude_n_m, 0.65), 2e-3, 1e-12);
}

TEST(ArmOptions, ContradictionsAreRefusedByName) {
  const std::pair<const char*, const char*> refusals[] = {
      {"arms.arm.radius=0.01", "arms[0].radius"},
      {"arms.arm.radius_profile={at = [0, 0.3], radius = [0.01, 0.01]}", "arms[0].radius_profile"},
      {"arms.arm.pieces[0].width=0.01", "arms[0].pieces[0].width"},
      {"arms.arm.pieces[0].inner_radius=0.02", "arms.arm.pieces[0].inner_radius"},
      {"arms.arm.pieces[1].flooded=true", "arms[0].pieces[1].flooded"},
      {"arms.arm.pieces[2].length=0.1", "arms.arm.pieces: their lengths add up to"},
      {"arms.arm.pieces[0].stiffness_matrix=[1, 2, 3]", "arms[0].pieces[0].stiffness_matrix"},
      {"arms.arm.muscles[0].wave_length=0", "arms[0].muscles[0].wave_length"},
      {"arms.arm.payloads[0].mass=0", "arms[0].payloads[0].mass"},
      {"arms.arm.payloads[0].drop=0", "arms[0].payloads[0].drop"},
      {"arms.arm.muscles[0].amplitude={ type = \"pulse\", high = 1, period = 0.1, rise = 0.2 }",
       "arms[0].muscles[0].amplitude.period"},
      {"arms.arm.muscles[0].amplitude={ type = \"pulse\", high = 1, period = 1e-9, rise = 1e-10 }",
       "arms[0].muscles[0].amplitude.period"},
      {"arms.arm.muscles[0].amplitude={ type = \"cubic\", time = [0, 0], value = [1, 2] }",
       "arms[0].muscles[0].amplitude.time"},
      {"effects.current={ x = { type = \"intervals\", value = 1, on = [0.1], off = [0.2] } }",
       "effects.current.x: jumps by 1 m/s"},
  };
  for (const auto& [override, path] : refusals) {
    EXPECT_NE(Message({override}).find(path), std::string::npos)
        << override << ": " << Message({override});
  }
  EXPECT_NE(Message({"robot.root=\"free\"", "robot.initial=\"static\""}).find("robot.initial"),
            std::string::npos);
  EXPECT_NE(
      Message({"robot.initial=\"static\"", "arms.arm.initial_strain={at = [0], bending_y = [1]}"})
          .find("arms[0].initial_strain"),
      std::string::npos);
  EXPECT_EQ(Message({}), "") << "the scene they are made from is sound";
}

}  // namespace
}  // namespace mantle::scene
