#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "loop/scene/text.h"
#include "loop/scene/toml_document.h"

namespace mantle::scene {
namespace {

using Kind = TomlValue::Kind;

constexpr std::size_t kLongestLine = 100;

std::string Quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string KeyText(const std::string& key) { return IsName(key) ? key : Quoted(key); }

std::string NumberText(const TomlValue& value) {
  if (value.kind == Kind::kInteger) return fmt::format("{:.0f}", value.number);
  if (!std::isfinite(value.number)) {
    return std::isnan(value.number) ? "nan" : value.number > 0 ? "inf" : "-inf";
  }
  const std::string text = fmt::format("{}", value.number);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

// On one line.
std::string Inline(const TomlValue& value) {
  std::vector<std::string> parts;
  switch (value.kind) {
    case Kind::kBoolean:
      return value.boolean ? "true" : "false";
    case Kind::kInteger:
    case Kind::kNumber:
      return NumberText(value);
    case Kind::kArray:
      for (const TomlValue& item : value.items) parts.push_back(Inline(item));
      return fmt::format("[{}]", fmt::join(parts, ", "));
    case Kind::kTable:
      for (std::size_t i = 0; i < value.items.size(); ++i) {
        parts.push_back(fmt::format("{} = {}", KeyText(value.keys[i]), Inline(value.items[i])));
      }
      return parts.empty() ? "{}" : fmt::format("{{ {} }}", fmt::join(parts, ", "));
    default:
      return Quoted(value.text);
  }
}

bool IsTables(const TomlValue& value) {
  return value.kind == Kind::kArray && !value.items.empty() &&
         std::all_of(value.items.begin(), value.items.end(),
                     [](const TomlValue& item) { return item.kind == Kind::kTable; });
}

// Under a heading of its own; tables of the document always, others where a line is too short.
bool HasHeading(const TomlValue& value, bool top) {
  if (value.kind != Kind::kTable && !IsTables(value)) return false;
  return top || Inline(value).size() > kLongestLine;
}

void WriteTable(const TomlValue& table, const std::string& path, std::string* out) {
  const bool top = path.empty();
  for (std::size_t i = 0; i < table.items.size(); ++i) {
    if (HasHeading(table.items[i], top)) continue;
    *out += fmt::format("{} = {}\n", KeyText(table.keys[i]), Inline(table.items[i]));
  }
  for (std::size_t i = 0; i < table.items.size(); ++i) {
    const TomlValue& item = table.items[i];
    if (!HasHeading(item, top)) continue;
    const std::string below = (top ? "" : path + ".") + KeyText(table.keys[i]);
    if (item.kind == Kind::kTable) {
      *out += fmt::format("\n[{}]\n", below);
      WriteTable(item, below, out);
      continue;
    }
    for (const TomlValue& element : item.items) {
      *out += fmt::format("\n[[{}]]\n", below);
      WriteTable(element, below, out);
    }
  }
}

}  // namespace

std::string WriteToml(const TomlValue& document) {
  std::string out;
  WriteTable(document, "", &out);
  return out;
}

}  // namespace mantle::scene
