#include "loop/scene/key_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <stdexcept>

#include "loop/scene/units.h"

namespace mantle::scene {
namespace {

using Kind = Entry::Kind;

constexpr std::string_view kBegin = "<!-- keys: ", kBeginEnd = " -->\n";
constexpr std::string_view kEnd = "<!-- end of keys -->\n";

/// One key, with every case of its table that has it.
struct Row {
  std::string path;
  std::vector<const Entry*> entries;
  const Keys* table;
};

std::string NumberText(double value) {
  std::string text = fmt::format("{:.10g}", value);
  for (const char* zero : {"e-0", "e+0"}) {
    const std::size_t at = text.find(zero);
    if (at != std::string::npos) text.erase(at + 2, 1);
  }
  return text;
}

std::string ValueText(const TomlValue& value) {
  switch (value.kind) {
    case TomlValue::Kind::kText:
      return fmt::format("`\"{}\"`", value.text);
    case TomlValue::Kind::kArray: {
      std::vector<std::string> items;
      for (const TomlValue& item : value.items) items.push_back(NumberText(item.number));
      return fmt::format("[{}]", fmt::join(items, ", "));
    }
    case TomlValue::Kind::kBoolean:
      return value.boolean ? "true" : "false";
    default:
      return NumberText(value.number);
  }
}

std::string TypeText(const Entry& e) {
  if (!e.type.empty() && e.kind != Kind::kNamedTables) return e.type;
  switch (e.kind) {
    case Kind::kNumber:
      return "number";
    case Kind::kInteger:
      return "integer";
    case Kind::kBoolean:
      return "true or false";
    case Kind::kNumbers:
      return e.count > 0 ? fmt::format("{} numbers", e.count) : "numbers";
    case Kind::kMatrix:
      return "3 rows of 3";
    case Kind::kTable:
    case Kind::kTableOrName:
      return "table";
    case Kind::kTables:
      return "array of tables";
    case Kind::kNamedTables:
      return fmt::format("{} by name", e.type);
    case Kind::kSwitch:
      return "true, false or table";
    default:
      return "text";
  }
}

std::string UnitText(const Entry& e) {
  if (!e.unit.empty()) return e.unit;
  const bool counts =
      e.kind == Kind::kNumber || e.kind == Kind::kNumbers || e.kind == Kind::kMatrix;
  return counts ? std::string(SiUnit(e.quantity)) : "";
}

std::string DefaultText(const Entry& e) {
  if (!e.fallback.empty()) return e.fallback;
  if (e.value) return ValueText(*e.value);
  for (const Entry& other : e.otherwise) {
    if (other.value) return ValueText(*other.value);
  }
  if (e.kind == Kind::kSwitch) return "false";
  if (e.presence == schema::Presence::kOptional) return "none";
  return e.presence == schema::Presence::kRequired ? "required" : "";
}

std::string ChoiceText(const std::vector<std::string>& choices) {
  return fmt::format("`\"{}\"`", fmt::join(choices, "\"`, `\""));
}

std::string RangeText(const Entry& e) {
  if (!e.bound.empty()) return e.bound;
  switch (e.kind) {
    case Kind::kNumber:
    case Kind::kNumbers: {
      const std::string text = BoundText(e.range);
      return text.starts_with("in ") ? text.substr(3) : text;
    }
    case Kind::kInteger:
      return fmt::format("[{}, {}]", e.low, e.high);
    case Kind::kName:
      return "letters, digits, `_`, `-`";
    case Kind::kChoice:
      return ChoiceText(e.choices);
    default:
      return "";
  }
}

// "this or `reel`", where the key excludes others.
std::string RivalText(const Row& row) {
  for (const Rivals& rivals : row.table->rivals) {
    const std::string& name = row.entries[0]->name;
    if (std::find(rivals.keys.begin(), rivals.keys.end(), name) == rivals.keys.end()) continue;
    std::vector<std::string> others;
    for (const std::string& key : rivals.keys) {
      if (key != name) others.push_back(fmt::format("`{}`", key));
    }
    return fmt::format("{} {}", rivals.none ? "not with" : "this or", fmt::join(others, ", "));
  }
  return "";
}

std::string Joined(std::vector<std::string> texts, std::string_view separator) {
  std::erase(texts, "");
  return fmt::format("{}", fmt::join(texts, separator));
}

std::string BoundColumn(const Row& row) {
  const Entry& e = *row.entries[0];
  std::vector<std::string> texts = {RangeText(e)};
  for (const Entry& other : e.otherwise) {
    const std::string text = RangeText(other);
    if (text != texts[0])
      texts.push_back(e.kind == Kind::kTable && other.kind == Kind::kChoice ? text + " or a table"
                                                                            : text);
  }
  texts.push_back(e.also);
  texts.push_back(RivalText(row));
  return Joined(std::move(texts), "; ");
}

// What the entries say, each with its case where they differ: "0.1; path 0.08".
template <typename Text>
std::string PerCase(const Row& row, std::string_view between, Text text_of) {
  std::vector<std::string> texts, cases;
  for (const Entry* e : row.entries) {
    const std::string text = text_of(*e);
    if (!texts.empty() && texts.back() == text) {
      cases.back() += ", " + e->only;
    } else {
      texts.push_back(text);
      cases.push_back(e->only);
    }
  }
  if (texts.size() == 1 && between == " ") return texts[0];
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (cases[i].empty()) continue;
    texts[i] = texts[i].empty() ? cases[i] : fmt::format("{}{}{}", cases[i], between, texts[i]);
  }
  return Joined(std::move(texts), "; ");
}

void AddRows(const Keys& keys, const std::string& prefix, bool below, std::vector<Row>* rows) {
  for (const Entry& e : keys.entries) {
    const std::string path = prefix + e.name;
    const auto same =
        std::find_if(rows->begin(), rows->end(), [&](const Row& r) { return r.path == path; });
    if (same != rows->end()) {
      same->entries.push_back(&e);
      continue;
    }
    rows->push_back({path, {&e}, &keys});
    if (below) AddRows(e.keys, path + ".", below, rows);
  }
}

std::string RowText(const Row& row) {
  const Entry& e = *row.entries[0];
  std::string type = TypeText(e);
  for (const Entry& other : e.otherwise) {
    if (e.type.empty()) type = fmt::format("{} or {}", TypeText(other), type);
  }
  const std::string unit = e.otherwise.empty() ? UnitText(e) : UnitText(e.otherwise[0]);
  return fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", row.path, type, unit,
                     PerCase(row, " ", DefaultText), BoundColumn(row),
                     PerCase(row, ": ", [](const Entry& entry) { return entry.meaning; }));
}

}  // namespace

std::string KeyTable(const Catalogue& catalogue, std::string_view parts) {
  std::vector<Row> rows;
  std::istringstream words{std::string(parts)};
  for (std::string part; words >> part;) {
    const auto& all = catalogue.scene.entries;
    const auto at =
        std::find_if(all.begin(), all.end(), [&](const Entry& e) { return e.name == part; });
    if (part == "scene") {
      AddRows(catalogue.scene, "", false, &rows);
    } else if (catalogue.types.contains(part)) {
      AddRows(catalogue.types.at(part), part + ".", true, &rows);
    } else if (at != all.end()) {
      AddRows(at->keys, part + ".", true, &rows);
    } else {
      throw std::invalid_argument(fmt::format("keys: \"{}\": no part of a scene", part));
    }
  }
  std::string out =
      "| key | type | unit | default | bound | meaning |\n|---|---|---|---|---|---|\n";
  for (const Row& row : rows) out += RowText(row);
  return out;
}

std::string WithKeyTables(const Catalogue& catalogue, std::string_view page) {
  std::set<std::string> missing = {"scene"};
  for (const Entry& e : catalogue.scene.entries) {
    if (!e.keys.entries.empty()) missing.insert(e.name);
  }
  for (const auto& [type, keys] : catalogue.types) missing.insert(type);
  std::string out;
  for (std::size_t at = 0;;) {
    const std::size_t begin = page.find(kBegin, at);
    if (begin == std::string_view::npos) {
      out += page.substr(at);
      break;
    }
    const std::size_t parts_at = begin + kBegin.size();
    const std::size_t parts_end = page.find(kBeginEnd, parts_at);
    const std::size_t end = page.find(kEnd, begin);
    if (parts_end == std::string_view::npos || end == std::string_view::npos) {
      throw std::invalid_argument("keys: a table is not ended by \"<!-- end of keys -->\"");
    }
    const std::string parts(page.substr(parts_at, parts_end - parts_at));
    std::istringstream words(parts);
    for (std::string part; words >> part;) {
      if (missing.erase(part) == 0) {
        throw std::invalid_argument(fmt::format("keys: \"{}\": stands in two tables", part));
      }
    }
    out += page.substr(at, parts_end + kBeginEnd.size() - at);
    out += fmt::format("\n{}\n{}", KeyTable(catalogue, parts), kEnd);
    at = end + kEnd.size();
  }
  if (!missing.empty()) {
    throw std::invalid_argument(fmt::format("keys: in no table: {}", fmt::join(missing, ", ")));
  }
  return out;
}

}  // namespace mantle::scene
