#include "tools/mantle/json_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "loop/scene/units.h"

namespace mantle::tools {
namespace {

using scene::Entry;
using scene::Keys;
using Kind = Entry::Kind;

constexpr std::string_view kNumberPattern = R"(^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)? *)";

// `text` as a regular expression that matches it.
std::string Escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (std::string_view("^$.*+?()[]{}|\\/").find(c) != std::string_view::npos) out += '\\';
    out += c;
  }
  return out;
}

// A text of number and unit; of any unit where the key's quantity is that of another key.
Json TextNumber(const Entry& e) {
  Json j{{"type", "string"}};
  if (!e.unit.empty()) return j;
  std::string units, all = scene::UnitsOf(e.quantity);
  for (std::size_t at = 0; at <= all.size();) {
    const std::size_t comma = std::min(all.find(", ", at), all.size());
    units += (units.empty() ? "" : "|") + Escaped(all.substr(at, comma - at));
    at = comma + 2;
  }
  j["pattern"] = fmt::format("{}({})$", kNumberPattern, units);
  return j;
}

Json NumberSchema(const Entry& e) {
  Json j{{"type", "number"}};
  if (e.bound.empty()) {
    if (std::isfinite(e.range.low)) {
      j[e.range.low_open ? "exclusiveMinimum" : "minimum"] = e.range.low;
    }
    if (std::isfinite(e.range.high)) j["maximum"] = e.range.high;
  }
  if (e.quantity == schema::Quantity::kNumber) return j;
  return {{"anyOf", {j, TextNumber(e)}}};
}

Json ArraySchema(Json items, int low, int high) {
  Json j{{"type", "array"}, {"items", std::move(items)}};
  if (low > 0) j["minItems"] = low;
  if (high >= 0) j["maxItems"] = high;
  return j;
}

/// Whether a table must hold what a scene needs. One that a scene merges over that of the scene it
/// extends need not; elements of arrays and tables that stand in several places must.
enum class Need { kAll, kNothing };

Json TableSchema(const Keys& keys, Need need);

Json Reference(const Entry& e, Need need) {
  return e.type.empty() ? TableSchema(e.keys, need) : Json{{"$ref", "#/$defs/" + e.type}};
}

Json ValueSchema(const Entry& e, Need need) {
  switch (e.kind) {
    case Kind::kNumber:
      return NumberSchema(e);
    case Kind::kInteger:
      return {{"type", "integer"}, {"minimum", e.low}, {"maximum", e.high}};
    case Kind::kBoolean:
      return {{"type", "boolean"}};
    case Kind::kText:
    case Kind::kReference:
      return {{"type", "string"}};
    case Kind::kName:
      return {{"type", "string"}, {"pattern", "^[A-Za-z0-9_-]+$"}};
    case Kind::kNumbers:
      return e.count >= 0 ? ArraySchema(NumberSchema(e), e.count, e.count)
                          : ArraySchema(NumberSchema(e), e.count == schema::kOneOrMore ? 1 : 0, -1);
    case Kind::kMatrix:
      return ArraySchema(ArraySchema(NumberSchema(e), 3, 3), 3, 3);
    case Kind::kChoice:
      return {{"enum", e.choices}};
    case Kind::kTable:
      return Reference(e, need);
    case Kind::kTables:
      return ArraySchema(Reference(e, Need::kAll), 0, -1);
    case Kind::kNamedTables:
      return {{"type", "object"}, {"additionalProperties", Reference(e, need)}};
    case Kind::kTableOrName:
      return {{"anyOf", {Json{{"type", "string"}}, Reference(e, need)}}};
    case Kind::kSwitch:
      return {{"anyOf", {Json{{"type", "boolean"}}, Reference(e, need)}}};
  }
  return {};
}

Json EntrySchema(const Entry& e, Need need) {
  Json j = ValueSchema(e, need);
  for (const Entry& other : e.otherwise) j = {{"anyOf", {j, ValueSchema(other, need)}}};
  if (!e.meaning.empty()) j["description"] = e.meaning;
  if (e.value && e.fallback.empty()) {
    switch (e.value->kind) {
      case scene::TomlValue::Kind::kBoolean:
        j["default"] = e.value->boolean;
        break;
      case scene::TomlValue::Kind::kInteger:
        j["default"] = static_cast<int>(e.value->number);
        break;
      case scene::TomlValue::Kind::kNumber:
        j["default"] = e.value->number;
        break;
      case scene::TomlValue::Kind::kText:
        j["default"] = e.value->text;
        break;
      default:
        break;
    }
  }
  return j;
}

// Of one case of a table, or of a table without cases where `only` is empty.
Json CaseSchema(const Keys& keys, const std::string& only, Need need) {
  Json properties = Json::object(), required = Json::array();
  for (const Entry& e : keys.entries) {
    if (!e.only.empty() && e.only != only) continue;
    Json j = EntrySchema(e, need);
    const bool chosen = e.is_case && !only.empty();
    if (chosen) j = {{"const", only}};
    properties[e.name] = std::move(j);
    const bool by_default = chosen && e.value && e.value->text == only;
    if ((chosen && !by_default) || e.presence == schema::Presence::kRequired) {
      required.push_back(e.name);
    }
  }
  Json j{{"type", "object"}, {"properties", properties}, {"additionalProperties", false}};
  if (!required.empty() && need == Need::kAll) j["required"] = required;
  return j;
}

void AddRivals(const Keys& keys, Need need, Json* j) {
  for (const scene::Rivals& rivals : keys.rivals) {
    Json one = Json::array(), any = Json::array();
    for (const std::string& key : rivals.keys) {
      one.push_back({{"required", {key}}});
      any.push_back({{"required", {key}}});
    }
    if (rivals.none || need == Need::kNothing) one.push_back({{"not", {{"anyOf", any}}}});
    (*j)["allOf"].push_back({{"oneOf", one}});
  }
}

Json TableSchema(const Keys& keys, Need need) {
  const auto tag = std::find_if(keys.entries.begin(), keys.entries.end(),
                                [](const Entry& e) { return e.is_case; });
  Json j;
  if (tag == keys.entries.end()) {
    j = CaseSchema(keys, "", need);
  } else {
    for (const std::string& only : tag->choices) {
      j["anyOf"].push_back(CaseSchema(keys, only, need));
    }
  }
  AddRivals(keys, need, &j);
  return j;
}

}  // namespace

Json JsonSchema(const scene::Catalogue& catalogue) {
  Json j{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "Mantle scene"}};
  j.update(TableSchema(catalogue.scene, Need::kNothing));
  j["if"] = {{"not", {{"required", {"extends"}}}}};
  j["then"] = {{"$ref", "#/$defs/scene"}};
  j["$defs"]["scene"] = TableSchema(catalogue.scene, Need::kAll);
  for (const auto& [type, keys] : catalogue.types) {
    j["$defs"][type] = TableSchema(keys, Need::kAll);
  }
  return j;
}

}  // namespace mantle::tools
