#include "tools/studies/effects_study.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <map>

#include "loop/scene/toml_document.h"
#include "tools/mantle/output_file.h"
#include "tools/report/child_process.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;
using scene::TomlValue;

// Keys of bodies that one effect alone reads; those of materials too.
const std::map<std::string, std::vector<std::string>> kParameters = {
    {"drag", {"drag_coefficients", "drag_coefficient"}},
    {"added_mass", {"added_mass_coefficient"}},
    {"viscosity", {"viscosity", "damping"}},
    {"jet_thrust", {"nozzle_radius"}},
};

void RemoveKeys(const std::vector<std::string>& keys, TomlValue* value) {
  if (value->kind == TomlValue::Kind::kTable) {
    for (const std::string& key : keys) value->Remove(key);
  }
  for (TomlValue& item : value->items) RemoveKeys(keys, &item);
}

bool IsOff(const TomlValue& value) {
  return value.kind == TomlValue::Kind::kBoolean && !value.boolean;
}

std::vector<std::string> Models(const EffectsScene& s) {
  std::vector<std::string> models{"plant", "reduced"};
  if (s.scene.control) models.push_back("controller");
  return models;
}

StudyPoint Reference(const EffectsScene& s, const std::string& model) {
  StudyPoint p;
  p.kind = "reference";
  p.family = "reference";
  p.name = model + " as it is";
  p.scene = s.file;
  p.overrides = s.overrides;
  p.options = {{"model", model == "reduced" ? "reduced" : "full"}};
  return p;
}

double NumberOf(const Json& row, const char* key) {
  return row.contains(key) && row[key].is_number() ? row[key].get<double>() : NAN;
}

Json Finite(double x) { return std::isfinite(x) ? Json(x) : Json(); }

}  // namespace

const char* ToString(WorkCounter counter) {
  switch (counter) {
    case WorkCounter::kCallgrind:
      return "callgrind";
    case WorkCounter::kPerf:
      return "perf";
    case WorkCounter::kTime:
      return "time";
  }
  return "time";
}

WorkCounter FindWorkCounter() {
  if (!FindProgram({"valgrind"}).empty()) return WorkCounter::kCallgrind;
  const fs::path perf = FindProgram({"perf"});
  if (perf.empty()) return WorkCounter::kTime;
  const fs::path log = fs::temp_directory_path() / fmt::format("mantle-perf-{}", getpid());
  ChildProcess child(perf, {"stat", "-e", "instructions:u", "true"}, {}, {}, log);
  const int status = child.Wait();
  std::ifstream in(log);
  const std::string said{std::istreambuf_iterator<char>(in), {}};
  fs::remove(log);
  const bool counts = status == 0 && said.find("not supported") == std::string::npos &&
                      said.find("not counted") == std::string::npos;
  return counts ? WorkCounter::kPerf : WorkCounter::kTime;
}

EffectsScene PrepareEffects(const std::string& file, const std::vector<std::string>& overrides) {
  EffectsScene s;
  s.file = fs::absolute(file).lexically_normal().string();
  s.overrides = overrides;
  s.scene = scene::LoadScene(file, overrides);
  s.counter = FindWorkCounter();
  s.count_s = std::min(s.count_s, s.scene.run.duration_s);
  if (!s.scene.has_time) {
    throw scene::BadScene(fmt::format(
        "{}: time: table is missing: `mantle study effects` needs [time] with `duration` > 0 s",
        file));
  }
  const TomlValue document = scene::ParseToml(s.scene.text, s.scene.name);
  if (const TomlValue* effects = document.Find("effects")) {
    for (std::size_t i = 0; i < effects->keys.size(); ++i) {
      if (effects->keys[i] != "gravity" && !IsOff(effects->items[i]))
        s.effects.push_back(effects->keys[i]);
    }
  }
  if (s.effects.empty()) {
    throw scene::BadScene(
        fmt::format("{}: effects: none is on: there is nothing to compare", file));
  }
  return s;
}

std::string WithoutEffect(const std::string& scene_text, const std::string& effect) {
  TomlValue document = scene::ParseToml(scene_text, "scene");
  if (TomlValue* effects = document.Find("effects")) {
    effects->Remove(effect);
    if (effect == "weight" || effect == "buoyancy") {
      const TomlValue *weight = effects->Find("weight"), *buoyancy = effects->Find("buoyancy");
      const bool heavy = weight != nullptr && !IsOff(*weight);
      if (!heavy && (buoyancy == nullptr || IsOff(*buoyancy))) effects->Remove("gravity");
    }
  }
  if (const auto keys = kParameters.find(effect); keys != kParameters.end()) {
    for (const char* part : {"arms", "mantle", "materials"}) {
      if (TomlValue* value = document.Find(part)) RemoveKeys(keys->second, value);
    }
  }
  return scene::WriteToml(document);
}

std::vector<StudyPoint> EffectsReferences(const EffectsScene& s) {
  return {Reference(s, "plant"), Reference(s, "reduced")};
}

std::vector<StudyPoint> EffectsPoints(const EffectsScene& s, const fs::path& folder) {
  std::vector<StudyPoint> points;
  for (const std::string& model : Models(s)) {
    const auto add = [&](const std::string& effect, const std::string& how) {
      StudyPoint p;
      p.kind = "effects";
      p.family = model;
      p.name = effect.empty() ? model + " as it is" : fmt::format("{} {} {}", model, how, effect);
      p.scene = s.file;
      p.overrides = s.overrides;
      if (how == "without") p.overrides.push_back(fmt::format("effects.{}=false", effect));
      if (how == "never") {
        const std::string file = fmt::format("never_{}.toml", effect);
        WriteWhole(folder, file, WithoutEffect(s.scene.text, effect));
        p.scene = (fs::absolute(folder) / file).string();
        p.overrides.clear();
      }
      p.options = {{"model", model}, {"counter", ToString(s.counter)}, {"count_s", s.count_s}};
      if (how == "without" && model != "controller")
        p.options["reference"] = ToJson(Reference(s, model));
      p.shown = {{"model", model}, {"effect", effect}, {"how", how}};
      points.push_back(std::move(p));
    };
    add("", "as it is");
    for (const std::string& effect : s.effects) {
      add(effect, "without");
      add(effect, "never");
    }
  }
  return points;
}

Json EffectsReport(const EffectsScene& s, const std::vector<Json>& references,
                   const std::vector<Json>& rows) {
  const auto find = [&](const std::string& model, const std::string& effect,
                        const std::string& how) {
    for (const Json& row : rows) {
      if (row["model"] == model && row["effect"] == effect && row["how"] == how) return row;
    }
    return Json::object();
  };
  Json lines = Json::array(), failures = Json::array();
  for (const std::string& model : Models(s)) {
    const double on = NumberOf(find(model, "", "as it is"), "work");
    for (const std::string& effect : s.effects) {
      const Json without = find(model, effect, "without"), never = find(model, effect, "never");
      const double off = NumberOf(without, "work"), absent = NumberOf(never, "work");
      Json line = {{"model", model},
                   {"effect", effect},
                   {"work_on", Finite(on)},
                   {"work_off", Finite(off)},
                   {"costs", Finite((on - off) / off)},
                   {"off_against_never", Finite((off - absent) / absent)},
                   {"state", without.value("state", Json())},
                   {"changes", without.value("error", Json())},
                   {"change_of", without.value("errors", Json())}};
      std::string reason = without.value("reason", std::string());
      if (reason.empty()) reason = never.value("reason", std::string());
      if (reason.empty()) reason = without.value("changes_reason", std::string());
      line["reason"] = reason;
      if (s.counter != WorkCounter::kTime && std::abs(off - absent) > kOffCosts * absent) {
        failures.push_back(
            fmt::format("{}: {} off takes {:.0f} instructions, {:.0f} where it is never "
                        "mentioned: more than {:g} apart",
                        model, effect, off, absent, kOffCosts));
      }
      lines.push_back(std::move(line));
    }
  }
  return {{"study", "effects"},
          {"scene", s.scene.name},
          {"scene_file", s.file},
          {"set", s.overrides},
          {"counter", ToString(s.counter)},
          {"counted_s", s.count_s},
          {"effects", lines},
          {"failures", failures},
          {"versions", StudyVersions()},
          {"references", references},
          {"points", rows}};
}

}  // namespace mantle::tools
