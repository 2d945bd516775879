#include <algorithm>

#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

ArmReduction ReadArmReduction(TomlReader* t, ArmReduction r) {
  r.basis = t->Choice<BasisKind>(
      "basis", {{"constant", BasisKind::kConstant}, {"legendre", BasisKind::kLegendre}}, r.basis);
  r.segments = t->Integer("segments", 1, 1000, r.segments);
  if (t->Has("segment_ends")) {
    r.segment_ends_m = t->Numbers("segment_ends", Quantity::kLength, kPositive);
  }
  r.degree = t->Integer("degree", 0, 12, r.degree);
  r.strains = t->Choice<StrainChoice>("strains",
                                      {{"bending", kBending},
                                       {"bending_torsion", kBendingTorsion},
                                       {"four", kFourStrains},
                                       {"six", kSixStrains}},
                                      r.strains);
  r.rule = t->Choice<SectionRule>("sections",
                                  {{"radau", SectionRule::kGaussRadau},
                                   {"legendre", SectionRule::kGaussLegendre},
                                   {"nodes", SectionRule::kPlantNodes}},
                                  r.rule);
  r.points = t->Integer("points", 1, 32, r.points);
  return r;
}

// Names of what can be driven, in the order of PlantInputs.
struct Drivable {
  std::vector<std::string> cables, loads, points, strips;
};
Drivable NamesOf(const Robot& robot) {
  Drivable d;
  for (const Arm& arm : robot.arms) {
    for (const auto& c : arm.cables) d.cables.push_back(arm.name + "." + c.name);
    for (const auto& l : arm.distributed) d.loads.push_back(arm.name + "." + l.name);
    for (const auto& p : arm.points) d.points.push_back(arm.name + "." + p.name);
  }
  if (robot.mantle) {
    for (const auto& s : robot.mantle->spokes) {
      d.cables.push_back(robot.mantle->name + "." + s.name);
    }
    for (const auto& s : robot.mantle->strips) {
      d.strips.push_back(robot.mantle->name + "." + s.name);
    }
  }
  return d;
}

Actuator ReadActuator(TomlReader t, const Drivable& names, int index) {
  Actuator a;
  a.name = t.Name("name", "motor" + std::to_string(index + 1));
  for (TomlReader& target : t.Tables("drives")) {
    ActuatorTarget out;
    out.gain = target.Number("gain", Quantity::kNumber, kAnyValue, 1.0);
    const auto find = [&](const char* key, const std::vector<std::string>& known,
                          ActuatorTarget::Kind kind) {
      if (!target.Has(key)) return false;
      const std::string name = target.Text(key, "");
      const auto at = std::find(known.begin(), known.end(), name);
      if (at == known.end()) {
        std::string list;
        for (const std::string& k : known) list += (list.empty() ? "" : ", ") + k;
        target.Fail(key, "must be one of: " + (list.empty() ? "none in this scene" : list));
      }
      out.kind = kind;
      out.index = static_cast<int>(at - known.begin());
      return true;
    };
    const bool cable = find("cable", names.cables, ActuatorTarget::Kind::kCable);
    const bool load = find("load", names.loads, ActuatorTarget::Kind::kDistributed);
    const bool point = find("point", names.points, ActuatorTarget::Kind::kPoint);
    const bool strip = find("strip", names.strips, ActuatorTarget::Kind::kStrip);
    if (cable + load + point + strip != 1) {
      target.Fail("cable", "give exactly one of `cable`, `load`, `point`, `strip`");
    }
    target.Finish();
    a.targets.push_back(out);
  }
  if (a.targets.empty()) t.Fail("drives", "is empty, must drive something");
  t.Finish();
  return a;
}

}  // namespace

std::vector<Actuator> CableActuators(const Robot& robot) {
  std::vector<Actuator> motors;
  for (const std::string& name : NamesOf(robot).cables) {
    const int index = static_cast<int>(motors.size());
    motors.push_back({name, {{ActuatorTarget::Kind::kCable, index, 1.0}}});
  }
  return motors;
}

Reduction ReadReduction(TomlReader t, const Robot& robot) {
  Reduction r;
  const ArmReduction all = ReadArmReduction(&t, {});
  r.arms.assign(std::max<std::size_t>(robot.arms.size(), 1), all);
  for (TomlReader& entry : t.Tables("arms")) {
    const std::string name = entry.Text("name", "");
    const auto arm = std::find_if(robot.arms.begin(), robot.arms.end(),
                                  [&](const Arm& a) { return a.name == name; });
    if (arm == robot.arms.end()) entry.Fail("name", "is no arm of this scene");
    r.arms[arm - robot.arms.begin()] = ReadArmReduction(&entry, all);
    entry.Finish();
  }
  r.mantle.modes = t.Integer("modes", 0, 8, r.mantle.modes);
  if (t.Has("static_pressures")) {
    const TomlValue* value = t.Raw("static_pressures");
    r.mantle.static_pressures_pa.emplace();
    if (value->kind != TomlValue::Kind::kArray || !value->items.empty()) {
      r.mantle.static_pressures_pa = t.Numbers("static_pressures", Quantity::kPressure, kPositive);
    }
  }
  r.mantle.snapshots = t.Integer("snapshots", 0, 8, r.mantle.snapshots);
  r.mantle.snapshot_time_s =
      t.Number("snapshot_time", Quantity::kTime, kPositive, r.mantle.snapshot_time_s);
  r.mantle.cubature_tolerance =
      t.Number("cubature", Quantity::kNumber, Range{0, 0.5}, r.mantle.cubature_tolerance);
  r.mantle.lateral_slices = t.Integer("lateral_slices", 0, 100000, r.mantle.lateral_slices);
  r.scheme = t.Choice<StepScheme>(
      "integrator",
      {{"sdirk2", StepScheme::kSdirk2}, {"backward_euler", StepScheme::kBackwardEuler}}, r.scheme);
  r.step_s = t.Number("step", Quantity::kTime, kPositive, r.step_s);
  r.tolerance = t.Number("tolerance", Quantity::kNumber, Range{0, 0.1, true}, r.tolerance);
  const Drivable names = NamesOf(robot);
  for (TomlReader& entry : t.Tables("actuators")) {
    r.actuators.push_back(ReadActuator(entry, names, static_cast<int>(r.actuators.size())));
  }
  t.Finish();
  return r;
}

}  // namespace mantle::scene
