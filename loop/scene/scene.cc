#include "loop/scene/scene.h"

#include <fmt/format.h>

#include "loop/scene/regular_file.h"
#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

RootMotion ReadRoot(TomlReader* robot) {
  const TomlValue* value = robot->Raw("root");
  if (value == nullptr || value->kind != TomlValue::Kind::kTable) {
    const bool clamped = robot->Choice<bool>("root", {{"free", false}, {"clamped", true}}, false);
    if (clamped) return ClampedRoot{};
    return FreeRoot{};
  }
  TomlReader table = robot->Table("root");
  PrescribedRoot root;
  root.x_m = ReadOptionalSchedule(&table, "x", Quantity::kLength, kAnyValue);
  root.y_m = ReadOptionalSchedule(&table, "y", Quantity::kLength, kAnyValue);
  root.z_m = ReadOptionalSchedule(&table, "z", Quantity::kLength, kAnyValue);
  root.angle_rad = ReadOptionalSchedule(&table, "angle", Quantity::kAngle, kAnyValue);
  root.rotation_axis = table.OptionalDirection("axis").value_or(Vector3::UnitZ());
  if (!root.x_m && !root.y_m && !root.z_m && !root.angle_rad) {
    table.Fail("x", "a prescribed root needs at least one of `x`, `y`, `z`, `angle`");
  }
  table.Finish();
  return root;
}

void ReadRobotTable(TomlReader table, Robot* robot) {
  robot->root = ReadRoot(&table);
  if (auto pose = table.OptionalTable("pose", "pose")) robot->root_pose = ReadPose(*pose);
  if (auto twist = table.OptionalTable("twist", "twist")) robot->root_twist = ReadTwist(*twist);
  robot->coupling = table.Choice<Coupling>(
      "coupling", {{"exact", Coupling::kExact}, {"frozen", Coupling::kFrozen}}, robot->coupling);
  robot->body_length_m = table.Number("body_length", Quantity::kLength, kPositive, 0.0);
  table.Finish();
}

void ReadTime(TomlReader table, RunSettings* run) {
  run->duration_s = table.Number("duration", Quantity::kTime, kPositive);
  run->step_s = table.Number("step", Quantity::kTime, kPositive, run->step_s);
  run->min_step_s = table.Number("min_step", Quantity::kTime, Range{0, run->step_s, true},
                                 std::min(run->min_step_s, run->step_s));
  StepperSettings& s = run->stepper;
  s.integrator = table.Choice<Integrator>("integrator",
                                          {{"sdirk2", Integrator::kSdirk2},
                                           {"sdirk3", Integrator::kSdirk3},
                                           {"backward_euler", Integrator::kBackwardEuler},
                                           {"rk4", Integrator::kRk4},
                                           {"cvode", Integrator::kCvode}},
                                          s.integrator);
  const Range tolerance{0, 0.1, true};
  s.newton_tolerance =
      table.Number("newton_tolerance", Quantity::kNumber, tolerance, s.newton_tolerance);
  s.newton_max_iterations = table.Integer("newton_iterations", 1, 1000, s.newton_max_iterations);
  s.relative_tolerance =
      table.Number("relative_tolerance", Quantity::kNumber, tolerance, s.relative_tolerance);
  s.absolute_tolerance =
      table.Number("absolute_tolerance", Quantity::kNumber, tolerance, s.absolute_tolerance);
  table.Finish();
}

void ReadOutput(TomlReader table, RunSettings* run) {
  run->output_interval_s =
      table.Number("interval", Quantity::kTime, kPositive, run->output_interval_s);
  run->account_energy = table.Boolean("energy", run->account_energy);
  table.Finish();
}

void ReadStatics(TomlReader table, StaticsSettings* s) {
  s->time_s = table.Number("time", Quantity::kTime, kAnyValue, s->time_s);
  s->load_steps = table.Integer("load_steps", 1, 1000000, s->load_steps);
  s->arc_length = table.Boolean("arc_length", s->arc_length);
  s->max_load_factor =
      table.Number("max_load_factor", Quantity::kNumber, kPositive, s->max_load_factor);
  s->max_points = table.Integer("max_points", 1, 1000000, s->max_points);
  s->stop_at_limit = table.Boolean("stop_at_limit", s->stop_at_limit);
  s->tolerance = table.Number("tolerance", Quantity::kNumber, Range{0, 0.1, true}, s->tolerance);
  s->max_iterations = table.Integer("max_iterations", 1, 1000, s->max_iterations);
  table.Finish();
}

// Reads all of [materials] for its errors alone: an unused material may not be wrong either.
void CheckMaterials(TomlReader* root) {
  if (!root->OptionalTable("materials")) return;
  SceneContext& context = root->context();
  context.materials = root->Raw("materials");
  for (std::size_t i = 0; i < context.materials->keys.size(); ++i) {
    ReadMaterialTable(TomlReader(context.materials->items[i],
                                 "materials." + context.materials->keys[i], "material", &context));
  }
}

void ReadBodies(TomlReader* root, Robot* robot) {
  auto arms = root->Tables("arms");
  for (std::size_t i = 0; i < arms.size(); ++i) {
    robot->arms.push_back(ReadArm(arms[i], static_cast<int>(i)));
  }
  if (auto mantle = root->OptionalTable("mantle")) robot->mantle = ReadMantle(*mantle);
  if (auto body = root->OptionalTable("rigid_body")) robot->rigid_body = ReadRigidBody(*body);
}

Scene ReadScene(const TomlValue& document, SceneContext* context) {
  TomlReader root(document, "", "", context);
  Scene scene;
  scene.name = root.Name("name", std::filesystem::path(context->name).stem().string());
  scene.description = root.Text("description", "");
  root.Text("extends", "");
  scene.robot.name = scene.name;
  if (auto water = root.OptionalTable("water")) {
    scene.robot.water.density_kg_m3 =
        water->Number("density", Quantity::kDensity, kPositive, scene.robot.water.density_kg_m3);
    water->Finish();
  }
  CheckMaterials(&root);
  if (auto robot = root.OptionalTable("robot")) ReadRobotTable(*robot, &scene.robot);
  ReadBodies(&root, &scene.robot);
  bool gravity_given = false;
  if (auto effects = root.OptionalTable("effects")) {
    gravity_given = effects->Has("gravity");
    scene.robot.effects = ReadEffects(*effects);
  }
  if (auto time = root.OptionalTable("time")) {
    ReadTime(*time, &scene.run);
    scene.has_time = true;
  }
  if (auto output = root.OptionalTable("output")) ReadOutput(*output, &scene.run);
  if (auto statics = root.OptionalTable("statics")) {
    ReadStatics(*statics, &scene.statics);
    scene.has_statics = true;
  }
  if (auto reduced = root.OptionalTable("reduced")) {
    scene.reduction = ReadReduction(*reduced, scene.robot);
  }
  if (auto control = root.OptionalTable("control")) {
    if (scene.reduction.actuators.empty()) scene.reduction.actuators = CableActuators(scene.robot);
    if (scene.reduction.actuators.empty()) {
      root.Fail("control", "there is no cable to pull: give arms or mantle cables");
    }
    for (const Actuator& motor : scene.reduction.actuators) {
      for (const ActuatorTarget& target : motor.targets) {
        if (target.kind != ActuatorTarget::Kind::kCable) {
          root.Fail("control", "motor " + motor.name + " drives what is no cable");
        }
      }
    }
    scene.control = ReadControl(*control, scene.robot, scene.reduction.actuators);
  }
  if (auto drives = root.OptionalTable("drives")) scene.drives = ReadDrives(*drives);
  if (auto sensors = root.OptionalTable("sensors")) scene.sensors = ReadSensors(*sensors);
  if (auto mismatch = root.OptionalTable("mismatch")) scene.mismatch = ReadMismatch(*mismatch);
  root.Finish();
  CheckScene(scene.robot, gravity_given, *context);
  return scene;
}

std::string ReadText(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMostBytes = 16 << 20;
  try {
    return ReadRegularFile(file, kMostBytes);
  } catch (const UnreadableFile& error) {
    throw BadScene(fmt::format("{}: cannot be read: {}", file.string(), error.what()));
  }
}

// The document with what it `extends` merged under it.
TomlValue ParseExtended(std::string_view toml, const std::string& name,
                        const std::filesystem::path& directory, int depth) {
  constexpr int kMaxDepth = 8;
  TomlValue document = ParseToml(toml, name);
  const TomlValue* base = document.Find("extends");
  if (base == nullptr || base->kind != TomlValue::Kind::kText) return document;
  if (depth == kMaxDepth) {
    throw BadScene(fmt::format("{}: extends: \"{}\": more than {} files deep, or in a circle", name,
                               base->text, kMaxDepth));
  }
  const std::filesystem::path file = directory / base->text;
  TomlValue merged =
      ParseExtended(ReadText(file), file.filename().string(), file.parent_path(), depth + 1);
  MergeToml(document, &merged);
  return merged;
}

}  // namespace

Scene ParseScene(std::string_view toml, const std::string& name,
                 const std::filesystem::path& directory, const std::vector<std::string>& overrides,
                 std::set<std::string>* known_keys) {
  TomlValue document = ParseExtended(toml, name, directory, 0);
  for (const std::string& text : overrides) ApplyOverride(text, &document);
  SceneContext context{name, directory, nullptr, {}};
  try {
    Scene scene = ReadScene(document, &context);
    scene.fingerprint = Hash(document, context.files_hash);
    if (known_keys != nullptr)
      known_keys->insert(context.known_keys.begin(), context.known_keys.end());
    return scene;
  } catch (const BadScene&) {
    if (known_keys != nullptr)
      known_keys->insert(context.known_keys.begin(), context.known_keys.end());
    throw;
  }
}

Scene LoadScene(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  return ParseScene(ReadText(file), file.filename().string(), file.parent_path(), overrides);
}

}  // namespace mantle::scene
