#include "loop/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "model/meridian.h"
#include "tests/support/paths.h"

namespace mantle::scene {

using namespace model;
namespace {

// The scenes and the physics page give numbers to four digits or so.
constexpr double kPrinted = 5e-4;
constexpr double kRoundOff = 1e-14;

constexpr const char* kVehicle = R"(
[rigid_body]
cone = { radius = "15 mm", height = "112 mm", density = 1022 }
[mantle]
shape = { type = "hemisphere_cylinder", radius = "31 mm", cylinder = "86 mm", meridian = "130 mm" }
half_thickness = "1 mm"
material = { young = "40 kPa", viscosity = 500, density = 1022 }
nozzle_radius = "10 mm"
added_mass_coefficient = 1.1
drag_coefficient = 1.7
strips = [{ name = "muscle", from = "25 mm", to = "105 mm", pressure = 100 }]
[[arms]]
name = "arm"
length = "420 mm"
radius = ["15 mm", "6 mm"]
material = { young = "110 kPa", viscosity = 300, density = 1022 }
added_mass_coefficient = 1.5
drag_coefficients = [0.01, 2.5, 2.5]
cables = [{ name = "left", tension = 1 }]
[effects]
weight = true
drag = true
added_mass = true
viscosity = true
jet_thrust = true
[time]
duration = 1
)";

Scene Vehicle(const std::vector<std::string>& overrides) {
  return ParseScene(kVehicle, "s.toml", ".", overrides);
}

std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// Message of the vehicle with the overrides; of the plant where the scene itself is read.
std::string Message(const std::vector<std::string>& overrides) {
  try {
    const Plant plant(Vehicle(overrides).robot);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Scene, ValuesArriveInSi) {
  const Scene scene = Vehicle({"time.step=2 ms", "arms.arm.cables.left.angle=\"90 deg\""});
  const Arm& arm = scene.robot.arms.at(0);
  EXPECT_DOUBLE_EQ(arm.length_m, 0.42);
  EXPECT_DOUBLE_EQ(arm.radius_base_m, 0.015);
  EXPECT_DOUBLE_EQ(arm.radius_tip_m, 0.006);
  EXPECT_DOUBLE_EQ(arm.material.young_pa, 110e3);
  EXPECT_DOUBLE_EQ(arm.cables.at(0).angle_rad, std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(arm.cables.at(0).end_m, 0.42) << "a cable ends at the tip unless said";
  EXPECT_DOUBLE_EQ(arm.cables.at(0).fraction, 0.6);
  EXPECT_DOUBLE_EQ(scene.run.step_s, 0.002);
  EXPECT_TRUE(scene.robot.effects.weight);
  EXPECT_FALSE(scene.robot.effects.buoyancy);
  EXPECT_FALSE(scene.robot.effects.named.Get<model::RollDrag>().has_value());
  EXPECT_TRUE(scene.has_time);
  EXPECT_FALSE(scene.has_statics);
}

TEST(Scene, ThePapersArmFrameIsThePapers) {
  const Scene scene = LoadScene(tests::SourcePath("scenes/paper.toml"));
  const Pose& mount = scene.robot.arms.at(0).mount;
  EXPECT_LT((mount.position - Vector3(0, 0, -0.112)).norm(), kRoundOff);
  EXPECT_LT((mount.rotation * Vector3::UnitX() + Vector3::UnitZ()).norm(), kRoundOff);
  EXPECT_LT((mount.rotation * Vector3::UnitY() + Vector3::UnitX()).norm(), kRoundOff);
  EXPECT_LT((mount.rotation * Vector3::UnitZ() - Vector3::UnitY()).norm(), kRoundOff);
}

TEST(Scene, ThePapersMantleIsThePapers) {
  const Plant plant(LoadScene(tests::SourcePath("scenes/paper.toml")).robot);
  const Mantle& mantle = *plant.robot.mantle;
  EXPECT_NEAR(MeridianLength(mantle), 0.130, kRoundOff);
  EXPECT_NEAR(mantle.theta0_rad, -0.1514, kPrinted);
  EXPECT_NEAR(MeridianAt(mantle, 0.130).r_m, 0.031, kRoundOff);
  EXPECT_NEAR(MeridianAt(mantle, 0.130).theta_rad, -std::numbers::pi / 2, kRoundOff);
  EXPECT_NEAR(plant.shell->area_m2, 0.022720, kPrinted * 0.022720);
  EXPECT_NEAR(plant.shell->mass_kg, 0.046, 0.0005) << "printed to the gram";
  EXPECT_NEAR(plant.shell->strips.at(0).strip.total_m2, 0.015355, kPrinted * 0.015355);
  EXPECT_DOUBLE_EQ(Value(plant.shell->strips[0].pressure_pa, 0.33), 325.0);
  EXPECT_DOUBLE_EQ(Value(plant.shell->strips[0].pressure_pa, 0.66), 0.0);
}

TEST(Scene, PosesComeFromAxesRotationVectorOrMatrix) {
  const std::vector<std::string> same = {
      "arms.arm.mount={axis = [0, 2, 0], normal = [-1, 0.5, 0]}",
      "arms.arm.mount={rotation = [0, 0, \"90 deg\"]}",
      "arms.arm.mount={matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}"};
  for (const std::string& mount : same) {
    const Pose pose = Vehicle({mount}).robot.arms.at(0).mount;
    EXPECT_LT((pose.rotation * Vector3::UnitX() - Vector3::UnitY()).norm(), kRoundOff) << mount;
    EXPECT_LT((pose.rotation * Vector3::UnitY() + Vector3::UnitX()).norm(), kRoundOff) << mount;
  }
}

TEST(Scene, TablesInTimeComeFromFiles) {
  const std::filesystem::path folder = testing::TempDir();
  std::ofstream(folder / "wave.csv") << "time_s,force_n\n# measured\n0,0\n0.5, 2\r\n1,0\n";
  std::ofstream(folder / "bad.csv") << "0,0\n1;2\n";
  const auto scene = [&](const std::string& file) {
    return ParseScene(kVehicle, "s.toml", folder,
                      {"arms.arm.cables.left.tension={type = \"table\", file = \"" + file + "\"}"});
  };
  const auto drive = std::get<GivenTension>(scene("wave.csv").robot.arms.at(0).cables.at(0).drive);
  EXPECT_DOUBLE_EQ(Value(drive.tension_n, 0.25), 1.0);
  EXPECT_THROW(scene("bad.csv"), BadScene);
  EXPECT_THROW(scene("absent.csv"), BadScene);
}

// Values of a few kinds of two scenes that a wrong round trip would change.
void ExpectSame(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.description, b.description);
  EXPECT_EQ(a.has_time, b.has_time);
  EXPECT_EQ(a.has_statics, b.has_statics);
  EXPECT_EQ(a.run.step_s, b.run.step_s);
  EXPECT_EQ(a.run.min_step_s, b.run.min_step_s);
  EXPECT_EQ(a.robot.root_pose.position, b.robot.root_pose.position);
  EXPECT_EQ(a.robot.root_pose.rotation.coeffs(), b.robot.root_pose.rotation.coeffs());
  EXPECT_EQ(a.robot.body_length_m, b.robot.body_length_m);
  EXPECT_EQ(a.reduction.arms.size(), b.reduction.arms.size());
  EXPECT_EQ(a.reduction.actuators.size(), b.reduction.actuators.size());
  EXPECT_EQ(a.mismatch.young, b.mismatch.young);
  EXPECT_EQ(a.sensors.strain_rate, b.sensors.strain_rate);
  ASSERT_EQ(a.control.has_value(), b.control.has_value());
  if (a.control) {
    EXPECT_EQ(a.control->grid.knots, b.control->grid.knots);
    EXPECT_EQ(a.control->goal.index(), b.control->goal.index());
    EXPECT_EQ(a.control->period_s, b.control->period_s);
    for (std::size_t i = 0; i < a.control->motors.size(); ++i) {
      EXPECT_EQ(a.control->motors[i].max_tension_n, b.control->motors[i].max_tension_n);
      EXPECT_EQ(a.control->gait.motors[i].high_n, b.control->gait.motors[i].high_n);
    }
  }
  // The whole robot, by what it does: every force at t = 0.
  const Plant plant(a.robot), other(b.robot);
  PlantWork work(plant), other_work(other);
  PlantInputs inputs, other_inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  EvaluateInputs(other, 0.0, false, &other_inputs);
  ASSERT_FALSE(EvaluateForces(plant, InitialState(plant), inputs, &work));
  ASSERT_FALSE(EvaluateForces(other, InitialState(other), other_inputs, &other_work));
  EXPECT_EQ(work.force, other_work.force);
}

struct Refusal {
  std::vector<std::string> overrides;
  const char* message;
};

TEST(Scene, WrongScenesAreRefusedInOneLine) {
  const std::vector<Refusal> refusals = {
      {{"arms[0].radius[1]=-0.006"}, "s.toml: arms[0].radius[1]: -0.006 m: must be > 0"},
      {{"arms.arm.lenght=1"}, "s.toml: arms[0].lenght: unknown key, did you mean \"length\"?"},
      {{"arms.arm.length=\"42 kPa\""},
       "s.toml: arms[0].length: \"42 kPa\": must be a number > 0 with unit m, mm, cm (a bare "
       "number "
       "is SI)"},
      {{"arms.arm.length=true"},
       "s.toml: arms[0].length: true: must be a number > 0 with unit m, mm, cm (a bare number is "
       "SI)"},
      {{"time.duration=nan"},
       "s.toml: time.duration: nan s: must be finite and in [1e-09, 1000000000]"},
      {{"mantle.material.young=inf"},
       "s.toml: mantle.material.young: inf Pa: must be finite and > 0"},
      {{"arms.arm.elements=0"},
       "s.toml: arms[0].elements: 0: must be a whole number in [1, 100000]"},
      {{"arms.arm.cables.left.fraction=1.2"},
       "s.toml: arms[0].cables[0].fraction: 1.2: must be in [0, 1]"},
      {{"arms.arm.cables.left.end=0.5"},
       "s.toml: arms[0].cables[0].end: 0.5 m: must be in (0, 0.42]"},
      {{"arms.arm.cables.left.tension=-1"},
       "s.toml: arms[0].cables[0].tension: -1 N: must be >= 0"},
      {{"arms.arm.cables.left.reel={length_change = 0, stiffness = 1}"},
       "s.toml: arms[0].cables[0].reel: a table: a cable must have exactly one of `tension` and "
       "`reel`"},
      {{"arms.arm.material=\"jelly\""},
       "s.toml: arms[0].material: \"jelly\": is not in [materials]"},
      {{"arms.arm.mount={axis = [1, 0, 0], normal = [2, 0, 0]}"},
       "s.toml: arms[0].mount.normal: [2, 0, 0]: must not be parallel to `axis`"},
      {{"arms.arm.mount={matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}"},
       "s.toml: arms[0].mount.matrix: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]: must be a rotation: "
       "orthogonal to 1e-6, with determinant 1"},
      {{"mantle.strips.muscle.to=\"131 mm\""},
       "s.toml: mantle.strips[0].to: 0.131 m: must be in (0.025, 0.13]"},
      {{"mantle.shape.type=\"sphere\""},
       "s.toml: mantle.shape.type: \"sphere\": must be one of \"hemisphere_cylinder\", "
       "\"cylinder\", \"cap\", \"annulus\", \"pieces\""},
      {{"mantle.strips.muscle.pressure={type = \"table\", time = [0, 2, 1], value = [0, 1, 0]}"},
       "s.toml: mantle.strips[0].pressure.time: [0, 2, 1]: must ascend; entry 2 is 1 s after 2 s"},
      {{"robot.root=\"clamped\"", "robot.coupling=\"frozen\""},
       "s.toml: robot.coupling: \"frozen\": must be \"exact\" where the root is not free"},
      {{"robot.root={ z = 0 }", "robot.coupling=\"frozen\""},
       "s.toml: robot.coupling: \"frozen\": must be \"exact\" where the root is not free"},
      {{"effects.gravity=[0, 0, -1]", "effects.weight=false"},
       "s.toml: effects.gravity: given, but neither `weight` nor `buoyancy` is named"},
      {{"arms.arm.drag_coefficients=[0, 0, 0]", "mantle.drag_coefficient=0"},
       "s.toml: effects.drag: named, but no arm has `drag_coefficients` and the mantle no "
       "`drag_coefficient` > 0"},
      {{"arms.arm.added_mass_coefficient=0", "mantle.added_mass_coefficient=0"},
       "s.toml: effects.added_mass: named, but no body has an `added_mass_coefficient` > 0"},
      {{"arms.arm.material.viscosity=0", "mantle.material.viscosity=0"},
       "s.toml: effects.viscosity: named, but no material has `viscosity` > 0 Pa s and no arm "
       "`damping`"},
      {{"rigid_body.cone={radius = 1, height = 1}"},
       "s.toml: rigid_body.cone.density: is missing: must be a number > 0 with unit kg/m^3, g/cm^3 "
       "(a bare number is SI)"},
      // What only the discretisation can know comes from the plant.
      {{"mantle.elements=2"},
       "mantle.elements = 2, must be >= 4: the meridian's pieces, strips and stations need a node "
       "at each of their ends"},
      {{"arms.arm.curvature=[0, 0, 60]", "arms.arm.elements=20"},
       "arms.arm.elements = 20: an element at rest turns 1.26 rad, must be < 1; the mesh is too "
       "coarse for the reference curvature"},
  };
  for (const Refusal& refusal : refusals) {
    EXPECT_EQ(Message(refusal.overrides), refusal.message);
  }
  EXPECT_EQ(Message({}), "") << "the scene they are made from is sound";
}

TEST(Scene, EffectsWithoutTheirBodyAreRefused) {
  const std::string arm_alone = R"(
arms = [{ length = 1, radius = 0.01, material = { young = 1e5, density = 1000 } }]
)";
  for (const char* effect :
       {"jet_thrust", "contained_water", "lateral_added_mass", "lateral_drag", "rigid_drag"}) {
    try {
      ParseScene(arm_alone, "s.toml", ".", {std::string("effects.") + effect + "=true"});
      ADD_FAILURE() << effect << " was accepted";
    } catch (const BadScene& error) {
      const std::string start =
          std::string("s.toml: effects.") + effect + ": named, but the scene has no ";
      EXPECT_EQ(std::string(error.what()).rfind(start, 0), 0u) << error.what();
    }
  }
  EXPECT_THROW(ParseScene(arm_alone, "s.toml", ".", {"effects.normal_pressure=1"}), BadScene);
  EXPECT_THROW(ParseScene("[time]\nduration = 1\n", "s.toml"), BadScene) << "no bodies";
}

TEST(Scene, AJetNeedsANozzle) {
  std::string text = kVehicle;
  text.erase(text.find("nozzle_radius"), std::string("nozzle_radius = \"10 mm\"\n").size());
  try {
    ParseScene(text, "s.toml");
    FAIL() << "was accepted";
  } catch (const BadScene& error) {
    EXPECT_STREQ(
        error.what(),
        "s.toml: effects.jet_thrust: named, but mantle.nozzle_radius is not given: must be "
        "> 0 m");
  }
}

TEST(Scene, MissingFilesAreNamed) {
  try {
    LoadScene("/nowhere/absent.toml");
    FAIL() << "was accepted";
  } catch (const BadScene& error) {
    EXPECT_STREQ(error.what(), "/nowhere/absent.toml: cannot be read: no such file");
  }
  EXPECT_THROW(LoadScene(testing::TempDir()), BadScene) << "a folder is no scene";
}

TEST(Scene, EveryShippedSceneParsesAndBuilds) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(tests::SourcePath("scenes"))) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    SCOPED_TRACE(entry.path().filename().string());
    const Scene scene = LoadScene(entry.path());
    EXPECT_FALSE(scene.description.empty());
    EXPECT_TRUE(scene.has_time || scene.has_statics);
    EXPECT_EQ(scene.has_statics,
              std::holds_alternative<ClampedRoot>(scene.robot.root) && !scene.has_time);
    EXPECT_GT(Plant(scene.robot).velocity_size(), 0);
    EXPECT_NE(ReadFile(entry.path()).find("# Look at: "), std::string::npos);
  }
  EXPECT_GE(count, 24);
}

TEST(Scene, FrozenPaperDiffersFromThePaperInItsCouplingAlone) {
  const auto bodies = [](const std::string& file) {
    std::string text = ReadFile(file);
    return text.substr(text.find("[robot]"));
  };
  std::string paper = bodies(tests::SourcePath("scenes/paper.toml"));
  const std::string exact = "coupling = \"exact\"";
  paper.replace(paper.find(exact), exact.size(), "coupling = \"frozen\"");
  paper.erase(paper.find("\n[reduced]"));  // the reduced model has exact coupling only
  EXPECT_EQ(bodies(tests::SourcePath("scenes/paper_frozen.toml")), paper);
}

// docs/scene.md against the reader.

std::vector<std::string> Examples(const std::string& page) {
  std::vector<std::string> blocks;
  const std::string open = "```toml\n", close = "```";
  for (std::size_t at = page.find(open); at != std::string::npos; at = page.find(open, at)) {
    at += open.size();
    const std::size_t end = page.find(close, at);
    blocks.push_back(page.substr(at, end - at));
    at = end;
  }
  return blocks;
}

TEST(SceneDocs, EveryExampleParsesAndBuilds) {
  const auto examples = Examples(ReadFile(tests::SourcePath("docs/scene.md")));
  ASSERT_GE(examples.size(), 8u);
  for (const std::string& example : examples) {
    SCOPED_TRACE(example);
    EXPECT_NO_THROW(Plant(ParseScene(example, "example.toml").robot));
  }
}

// `--write`: the text of a scene.

TEST(SceneText, EveryShippedSceneReadsBackTheSame) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(tests::SourcePath("scenes"))) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    SCOPED_TRACE(entry.path().filename().string());
    const Scene scene = LoadScene(entry.path());
    const Scene again =
        ParseScene(scene.text, entry.path().filename().string(), entry.path().parent_path());
    EXPECT_EQ(again.text, scene.text);
    EXPECT_TRUE(again.files.empty()) << "what it extends is merged";
    ExpectSame(again, scene);
  }
  EXPECT_GE(count, 24);
}

TEST(SceneText, SpellsOutDefaultsAndKeepsWhatWasWritten) {
  const std::string text = Vehicle({"time.step=2 ms"}).text;
  for (const char* line :
       {"name = \"s\"", "step = \"2 ms\"", "integrator = \"sdirk2\"", "elements = 20",
        "length = \"420 mm\"", "density = 1022.0", "buoyancy = false", "seed = 1", "segments = 4",
        "gravity = [0.0, 0.0, -9.81]"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << " is missing in\n" << text;
  }
  EXPECT_EQ(text.find("[statics]"), std::string::npos) << "absent means that nothing is solved";
  EXPECT_EQ(text.find("body_length"), std::string::npos) << "absent means the extent";
}

TEST(Scene, AnOverrideOfExtendsChoosesTheBase) {
  const std::filesystem::path folder = testing::TempDir();
  std::ofstream(folder / "base.toml") << kVehicle;
  const std::string own = "[time]\nduration = 3\n";
  EXPECT_THROW(ParseScene(own, "s.toml", folder), BadScene) << "no bodies";
  const Scene scene =
      ParseScene(own, "s.toml", folder, {"arms.arm.elements=7", "extends=base.toml"});
  EXPECT_EQ(scene.robot.arms.at(0).elements, 7) << "overrides enter what the base brings";
  EXPECT_EQ(scene.run.duration_s, 3);
  ASSERT_EQ(scene.files.size(), 1u);
  EXPECT_EQ(scene.files[0].filename(), "base.toml");
  EXPECT_THROW(ParseScene(own, "s.toml", folder, {"extends=absent.toml"}), BadScene);
}

TEST(Scene, AFileIsLookedForBesideTheSceneThatNamesIt) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "beside";
  std::filesystem::create_directories(folder / "bases" / "data");
  std::ofstream(folder / "bases" / "data" / "pull.csv") << "0,0\n1,0.5\n";
  std::ofstream(folder / "own.csv") << "0,0\n1,0.25\n";
  const auto tension = [](const std::string& file) {
    return "tension={ type = \"table\", file = \"" + file + "\" }";
  };
  std::string base(kVehicle);
  const std::string constant = "tension = 1";
  ASSERT_NE(base.find(constant), std::string::npos);
  base.replace(base.find(constant), constant.size(), tension("data/pull.csv"));
  std::ofstream(folder / "bases" / "base.toml") << base;
  const auto last = [](const Scene& scene) {
    const auto& drive = scene.robot.arms.at(0).cables.at(0).drive;
    return std::get<model::TableSchedule>(std::get<model::GivenTension>(drive).tension_n)
        .value.back();
  };
  const Scene scene = ParseScene("extends = \"bases/base.toml\"\n", "s.toml", folder);
  EXPECT_EQ(last(scene), 0.5) << "named by the base";
  EXPECT_EQ(last(ParseScene(scene.text, "s.toml", folder)), 0.5) << "written out: " << scene.text;
  EXPECT_EQ(last(ParseScene("extends = \"bases/base.toml\"\n", "s.toml", folder,
                            {"arms.arm.cables.left." + tension("own.csv")})),
            0.25)
      << "named by the scene itself";
}

TEST(Scene, AnyFileNameWillDo) {
  EXPECT_EQ(ParseScene(kVehicle, "my scene.toml").name, "my_scene");
  EXPECT_EQ(ParseScene(kVehicle, "paper-2.toml").name, "paper-2");
  EXPECT_THROW(ParseScene(std::string("name = \"my scene\"\n") + kVehicle, "s.toml"), BadScene)
      << "a name that is given is taken as it is, or refused";
}

}  // namespace
}  // namespace mantle::scene
