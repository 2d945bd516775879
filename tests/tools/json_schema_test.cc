#include "tools/mantle/json_schema.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "loop/scene/scene_schema.h"
#include "tests/support/paths.h"

namespace mantle::tools {
namespace {

using scene::TomlValue;

/// A validator of the keywords that the schema uses; an unknown one is a failure, so that none is
/// silently ignored. Returns the path of the first violation, empty where there is none.
class Validator {
 public:
  explicit Validator(Json schema) : root_(std::move(schema)) {}

  std::string Violation(const Json& value) const { return Check(root_, value, "scene"); }

 private:
  Json root_;

  static bool IsType(const Json& value, const std::string& type) {
    return type == "object"    ? value.is_object()
           : type == "array"   ? value.is_array()
           : type == "string"  ? value.is_string()
           : type == "boolean" ? value.is_boolean()
           : type == "integer" ? value.is_number_integer()
                               : type == "number" && value.is_number();
  }

  std::string Check(const Json& schema, const Json& value, const std::string& path) const {
    for (const auto& [keyword, rule] : schema.items()) {
      const std::string bad = CheckKeyword(keyword, rule, schema, value, path);
      if (!bad.empty()) return bad;
    }
    return "";
  }

  int Matches(const Json& schemas, const Json& value, const std::string& path) const {
    return static_cast<int>(std::count_if(schemas.begin(), schemas.end(), [&](const Json& s) {
      return Check(s, value, path).empty();
    }));
  }

  std::string CheckKeyword(const std::string& keyword, const Json& rule, const Json& schema,
                           const Json& value, const std::string& path) const {
    const auto need = [&](bool ok) { return ok ? "" : path + ": " + keyword; };
    if (keyword == "$schema" || keyword == "title" || keyword == "description" ||
        keyword == "default" || keyword == "$defs" || keyword == "then") {
      return "";
    }
    if (keyword == "type") return need(IsType(value, rule));
    if (keyword == "const") return need(value == rule);
    if (keyword == "enum") return need(std::find(rule.begin(), rule.end(), value) != rule.end());
    if (keyword == "minimum") return need(!value.is_number() || value >= rule);
    if (keyword == "exclusiveMinimum") return need(!value.is_number() || value > rule);
    if (keyword == "maximum") return need(!value.is_number() || value <= rule);
    if (keyword == "minItems") return need(!value.is_array() || value.size() >= rule);
    if (keyword == "maxItems") return need(!value.is_array() || value.size() <= rule);
    if (keyword == "pattern") {
      return need(!value.is_string() ||
                  std::regex_search(value.get<std::string>(), std::regex(rule.get<std::string>())));
    }
    if (keyword == "if") {
      return Check(rule, value, path).empty() ? Check(schema["then"], value, path) : "";
    }
    if (keyword == "$ref") {
      return Check(root_["$defs"].at(rule.get<std::string>().substr(8)), value, path);
    }
    if (keyword == "anyOf") return need(Matches(rule, value, path) >= 1);
    if (keyword == "oneOf") return need(Matches(rule, value, path) == 1);
    if (keyword == "not") return need(!Check(rule, value, path).empty());
    if (keyword == "allOf") {
      return need(Matches(rule, value, path) == static_cast<int>(rule.size()));
    }
    if (keyword == "required") {
      return need(!value.is_object() || std::all_of(rule.begin(), rule.end(), [&](const Json& key) {
        return value.contains(key.get<std::string>());
      }));
    }
    if (keyword == "items") return CheckItems(rule, value, path);
    if (keyword == "properties" || keyword == "additionalProperties") {
      return keyword == "properties" && schema.contains("additionalProperties")
                 ? ""  // both are checked with additionalProperties
                 : CheckProperties(schema, value, path);
    }
    return path + ": unknown keyword " + keyword;
  }

  std::string CheckItems(const Json& rule, const Json& value, const std::string& path) const {
    if (!value.is_array()) return "";
    for (std::size_t i = 0; i < value.size(); ++i) {
      const std::string bad = Check(rule, value[i], path + "[" + std::to_string(i) + "]");
      if (!bad.empty()) return bad;
    }
    return "";
  }

  std::string CheckProperties(const Json& schema, const Json& value,
                              const std::string& path) const {
    if (!value.is_object()) return "";
    const Json none = Json::object();
    const Json& known = schema.contains("properties") ? schema["properties"] : none;
    const Json& others = schema["additionalProperties"];
    for (const auto& [key, item] : value.items()) {
      const std::string at = path + "." + key;
      if (!known.contains(key) && others == false) return at + ": unknown key";
      const std::string bad = Check(known.contains(key) ? known[key] : others, item, at);
      if (!bad.empty()) return bad;
    }
    return "";
  }
};

Json ToJson(const TomlValue& value) {
  switch (value.kind) {
    case TomlValue::Kind::kBoolean:
      return value.boolean;
    case TomlValue::Kind::kInteger:
      return static_cast<std::int64_t>(value.number);
    case TomlValue::Kind::kNumber:
      return value.number;
    case TomlValue::Kind::kArray: {
      Json j = Json::array();
      for (const TomlValue& item : value.items) j.push_back(ToJson(item));
      return j;
    }
    case TomlValue::Kind::kTable: {
      Json j = Json::object();
      for (std::size_t i = 0; i < value.keys.size(); ++i) j[value.keys[i]] = ToJson(value.items[i]);
      return j;
    }
    default:
      return value.text;
  }
}

const Validator& Schema() {
  static const Validator validator(JsonSchema(scene::SceneCatalogue()));
  return validator;
}

std::string Violation(const std::string& toml) {
  return Schema().Violation(ToJson(scene::ParseToml(toml, "s.toml")));
}

TEST(JsonSchema, EveryShippedSceneIsValidAsItIsAndSpeltOut) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(tests::SourcePath("scenes"))) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    std::ifstream in(entry.path());
    std::ostringstream text;
    text << in.rdbuf();
    EXPECT_EQ(Violation(text.str()), "") << entry.path();
    EXPECT_EQ(Violation(scene::LoadScene(entry.path()).text), "") << entry.path();
  }
  EXPECT_GE(count, 24);
}

TEST(JsonSchema, EveryExampleOfThePageIsValid) {
  std::ifstream in(tests::SourcePath("docs/scene.md"));
  std::ostringstream text;
  text << in.rdbuf();
  const std::string page = text.str(), open = "```toml\n";
  int count = 0;
  for (std::size_t at = page.find(open); at != std::string::npos; at = page.find(open, at)) {
    at += open.size();
    const std::string example = page.substr(at, page.find("```", at) - at);
    EXPECT_EQ(Violation(example), "") << example;
    ++count;
  }
  EXPECT_GE(count, 8);
}

TEST(JsonSchema, WrongKeysTypesUnitsAndBoundsAreNot) {
  const std::string arm = "arms = [{ length = 1, radius = 0.01, material = \"m\"";
  EXPECT_EQ(Violation(arm + " }]\n"), "");
  EXPECT_EQ(Violation("[time]\nduration = 1\nstepp = 1\n"), "scene.time.stepp: unknown key");
  EXPECT_EQ(Violation("[time]\nstep = 1\n"), "scene.time: required");
  EXPECT_EQ(Violation("extends = \"a.toml\"\n[time]\nstep = 1\n"), "") << "merged over a's";
  EXPECT_EQ(Violation("[time]\nduration = \"1 m\"\n"), "scene.time.duration: anyOf");
  EXPECT_EQ(Violation("[time]\nduration = \"1 ms\"\n"), "");
  EXPECT_EQ(Violation("[time]\nduration = -1\n"), "scene.time.duration: anyOf");
  EXPECT_EQ(Violation("[time]\nduration = 1\nintegrator = \"euler\"\n"),
            "scene.time.integrator: enum");
  EXPECT_EQ(Violation("name = \"my scene\"\n"), "scene.name: pattern");
  EXPECT_EQ(Violation("[sensors]\nseed = 1.5\n"), "scene.sensors.seed: type");
  EXPECT_EQ(Violation("[effects]\njet_thrust = 3\n"), "scene.effects.jet_thrust: anyOf");
  EXPECT_EQ(Violation("[effects]\njet_thrust = { flux = \"volume\" }\n"), "");
  EXPECT_EQ(Violation(arm + ", cables = [{ tension = 1 }] }]\n"), "");
  EXPECT_EQ(Violation(arm + ", cables = [{ turns = 1 }] }]\n"), "scene.arms[0].cables[0]: allOf");
  EXPECT_EQ(Violation(arm + ", cables = [{ tension = 1, reel = { length_change = 0, stiffness = 1 "
                            "} }] }]\n"),
            "scene.arms[0].cables[0]: allOf");
  EXPECT_EQ(Violation(arm + ", mount = { axis = [1, 0, 0], rotation = [0, 0, 0] } }]\n"),
            "scene.arms[0].mount: allOf");
  EXPECT_EQ(Violation("[control.goal]\ntype = \"circle\"\nspeed = 1\n"),
            "scene.control.goal: anyOf")
      << "a speed is of a cruise or a path";
  EXPECT_EQ(Violation("[control.goal]\nspeed = 1\n"), "") << "a cruise";
}

}  // namespace
}  // namespace mantle::tools
