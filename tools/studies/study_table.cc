#include "tools/studies/study_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace mantle::tools {
namespace {

using Cells = std::vector<std::pair<std::string, std::string>>;

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + "\"";
}

std::string Text(const Json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());
  return value.dump();
}

void Flatten(const std::string& path, const Json& value, Cells* cells) {
  if (value.is_object()) {
    for (const auto& [key, item] : value.items()) {
      Flatten(path.empty() ? key : path + "." + key, item, cells);
    }
    return;
  }
  if (value.is_array()) {
    std::string text;
    for (const Json& item : value) text += (text.empty() ? "" : "; ") + Text(item);
    cells->emplace_back(path, text);
    return;
  }
  cells->emplace_back(path, Text(value));
}

}  // namespace

std::string StudyCsv(const std::vector<Json>& rows, const Json& versions) {
  std::vector<std::string> titles;
  std::vector<std::map<std::string, std::string>> table;
  for (const Json& row : rows) {
    Cells cells;
    Flatten("", row, &cells);
    for (const char* key : {"mantle", "program", "processor", "date"}) {
      cells.emplace_back(std::string("versions.") + key, Text(versions.value(key, Json())));
    }
    table.emplace_back();
    for (const auto& [title, text] : cells) {
      table.back()[title] = text;
      if (std::find(titles.begin(), titles.end(), title) == titles.end()) titles.push_back(title);
    }
  }
  std::string csv;
  for (std::size_t i = 0; i < titles.size(); ++i) csv += (i > 0 ? "," : "") + Quoted(titles[i]);
  csv += '\n';
  for (const auto& cells : table) {
    for (std::size_t i = 0; i < titles.size(); ++i) {
      if (i > 0) csv += ',';
      if (const auto at = cells.find(titles[i]); at != cells.end()) csv += Quoted(at->second);
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace mantle::tools
