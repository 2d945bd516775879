#include "loop/scene/toml_document.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "loop/scene/text.h"

namespace mantle::scene {
namespace {

using Kind = TomlValue::Kind;

TomlValue Convert(const toml::node& node) {
  TomlValue out;
  if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      out.keys.emplace_back(key.str());
      out.items.push_back(Convert(value));
    }
  } else if (const auto* array = node.as_array()) {
    out.kind = Kind::kArray;
    for (const auto& value : *array) out.items.push_back(Convert(value));
  } else if (const auto* boolean = node.as_boolean()) {
    out.kind = Kind::kBoolean;
    out.boolean = boolean->get();
  } else if (const auto* integer = node.as_integer()) {
    out.kind = Kind::kInteger;
    out.number = static_cast<double>(integer->get());
  } else if (const auto* number = node.as_floating_point()) {
    out.kind = Kind::kNumber;
    out.number = number->get();
  } else if (const auto* text = node.as_string()) {
    out.kind = Kind::kText;
    out.text = text->get();
  } else {
    out.kind = Kind::kDate;
  }
  return out;
}

BadScene BadOverride(std::string_view text, const std::string& why) {
  return BadScene(fmt::format("--set {}: {}", Printable(text), why));
}

// The most parts that a key in `text` has, a.b.c being three. Dots in texts and comments do not
// count, those of numbers do: a number has one.
int MostKeyParts(std::string_view text) {
  int parts = 1, most = 1;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      parts = 1;
    } else if (c == '"' || c == '\'') {
      const std::string_view quotes = text.substr(i, 3);
      const bool block = quotes == "\"\"\"" || quotes == "'''";
      const std::string_view end = block ? quotes : text.substr(i, 1);
      for (i += end.size(); i < text.size() && text.substr(i, end.size()) != end; ++i) {
        if (c == '"' && text[i] == '\\') ++i;
        if (!block && i < text.size() && text[i] == '\n') break;
      }
      i += end.size() - 1;
    } else if (c == '.') {
      most = std::max(most, ++parts);
    } else if (c == '\n' || c == '=' || c == ',' || c == '[' || c == '{') {
      parts = 1;
    }
  }
  return most;
}

// What stands against reading `text`; empty where nothing does.
std::string Objection(std::string_view text) {
  if (!IsUtf8(text)) return "is not UTF-8 text";
  const int parts = MostKeyParts(text);
  return parts > kMaxKeyParts
             ? fmt::format("a key has {} parts, must be <= {}", parts, kMaxKeyParts)
             : "";
}

TomlValue ValueOfOverride(std::string_view text) {
  try {
    const toml::table parsed = toml::parse(fmt::format("x = {}", text));
    if (parsed.size() == 1 && parsed.contains("x")) return Convert(*parsed.get("x"));
  } catch (const toml::parse_error&) {
  }
  return TomlText(std::string(text));
}

std::optional<std::size_t> Index(std::string_view text) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return index;
}

// "a.b[2].c" -> a, b, 2, c.
std::vector<std::string> Steps(std::string_view path) {
  std::vector<std::string> steps(1);
  for (const char c : path) {
    if (c == '.' || c == '[') {
      steps.emplace_back();
    } else if (c != ']') {
      steps.back() += c;
    }
  }
  return steps;
}

TomlValue* Enter(std::string_view whole, const std::string& step, TomlValue* at) {
  if (at->kind == Kind::kArray) {
    if (const auto index = Index(step)) {
      if (*index < at->items.size()) return &at->items[*index];
      throw BadOverride(whole, fmt::format("index {}: must be < {}", step, at->items.size()));
    }
    for (TomlValue& item : at->items) {
      const TomlValue* name = item.Find("name");
      if (name != nullptr && name->text == step) return &item;
    }
    throw BadOverride(whole, fmt::format("no element is named \"{}\"", step));
  }
  if (at->kind != Kind::kTable) {
    // A short form (`arms = "x"`, `jet_thrust = true`) that is entered becomes a table.
    *at = TomlValue{};
  }
  if (TomlValue* found = at->Find(step)) return found;
  at->keys.push_back(step);
  return &at->items.emplace_back();
}

}  // namespace

const TomlValue* TomlValue::Find(std::string_view key) const {
  const auto at = std::find(keys.begin(), keys.end(), key);
  return at == keys.end() ? nullptr : &items[at - keys.begin()];
}

TomlValue* TomlValue::Find(std::string_view key) {
  const auto at = std::find(keys.begin(), keys.end(), key);
  return at == keys.end() ? nullptr : &items[at - keys.begin()];
}

void TomlValue::Set(std::string_view key, TomlValue value) {
  if (TomlValue* found = Find(key)) {
    *found = std::move(value);
  } else {
    keys.emplace_back(key);
    items.push_back(std::move(value));
  }
}

void TomlValue::Remove(std::string_view key) {
  const auto at = std::find(keys.begin(), keys.end(), key) - keys.begin();
  if (at == static_cast<std::ptrdiff_t>(keys.size())) return;
  keys.erase(keys.begin() + at);
  items.erase(items.begin() + at);
}

TomlValue TomlBoolean(bool value) {
  TomlValue out;
  out.kind = Kind::kBoolean;
  out.boolean = value;
  return out;
}

TomlValue TomlInteger(int value) {
  TomlValue out;
  out.kind = Kind::kInteger;
  out.number = value;
  return out;
}

TomlValue TomlNumber(double value) {
  TomlValue out;
  out.kind = Kind::kNumber;
  out.number = value;
  return out;
}

TomlValue TomlText(std::string value) {
  TomlValue out;
  out.kind = Kind::kText;
  out.text = std::move(value);
  return out;
}

TomlValue TomlNumbers(const std::vector<double>& values) {
  TomlValue out;
  out.kind = Kind::kArray;
  for (const double value : values) out.items.push_back(TomlNumber(value));
  return out;
}

std::string Describe(const TomlValue& value) {
  switch (value.kind) {
    case Kind::kBoolean:
      return value.boolean ? "true" : "false";
    case Kind::kInteger:
    case Kind::kNumber:
      return fmt::format("{}", value.number);
    case Kind::kText:
      return fmt::format("\"{}\"", Printable(value.text));
    case Kind::kArray: {
      if (value.items.size() > 6) return fmt::format("an array of {}", value.items.size());
      std::string out = "[";
      for (const TomlValue& item : value.items) {
        if (out.size() > 1) out += ", ";
        out += Describe(item);
      }
      return out + "]";
    }
    case Kind::kTable:
      return "a table";
    case Kind::kDate:
      return "a date or time";
  }
  return "";
}

TomlValue ParseToml(std::string_view text, const std::string& name) {
  if (const std::string why = Objection(text); !why.empty()) {
    throw BadScene(fmt::format("{}: {}", name, why));
  }
  try {
    return Convert(toml::parse(text, name));
  } catch (const toml::parse_error& error) {
    throw BadScene(fmt::format("{}: line {}, column {}: {}", name, error.source().begin.line,
                               error.source().begin.column, Printable(error.description())));
  }
}

void ApplyOverride(std::string_view override_text, TomlValue* document) {
  const std::size_t equals = override_text.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw BadOverride(override_text, "must be key=value, such as time.step=0.005");
  }
  if (const std::string why = Objection(override_text); !why.empty()) {
    throw BadOverride(override_text, why);
  }
  const std::vector<std::string> steps = Steps(override_text.substr(0, equals));
  if (steps.size() > kMaxKeyParts) {
    throw BadOverride(override_text,
                      fmt::format("a key has {} parts, must be <= {}", steps.size(), kMaxKeyParts));
  }
  TomlValue* at = document;
  for (const std::string& step : steps) {
    if (step.empty()) throw BadOverride(override_text, "the path has an empty part");
    at = Enter(override_text, step, at);
  }
  *at = ValueOfOverride(override_text.substr(equals + 1));
}

void NoteFolder(const std::string& folder, TomlValue* document) {
  if (document->kind == TomlValue::Kind::kText) document->folder = folder;
  for (TomlValue& item : document->items) NoteFolder(folder, &item);
}

void MergeToml(const TomlValue& over, TomlValue* base) {
  for (std::size_t i = 0; i < over.keys.size(); ++i) {
    TomlValue* below = base->Find(over.keys[i]);
    if (below == nullptr) {
      base->keys.push_back(over.keys[i]);
      base->items.push_back(over.items[i]);
    } else if (below->kind == TomlValue::Kind::kTable &&
               over.items[i].kind == TomlValue::Kind::kTable) {
      MergeToml(over.items[i], below);
    } else {
      *below = over.items[i];
    }
  }
}

}  // namespace mantle::scene
