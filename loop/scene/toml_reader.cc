#include "loop/scene/toml_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "loop/scene/regular_file.h"
#include "loop/scene/text.h"

namespace mantle::scene {
namespace {

using Kind = TomlValue::Kind;
using schema::Key;
using schema::Presence;
using schema::Range;

constexpr std::uintmax_t kLargestFile_bytes = 64 << 20;

std::string NeededNumber(Quantity quantity, Range range) {
  const std::string units = UnitsOf(quantity), bound = BoundText(range);
  return fmt::format("must be a number{}{}{}", bound.empty() ? "" : " ", bound,
                     units.empty() ? "" : " with unit " + units + " (a bare number is SI)");
}

template <typename Names>
std::string OneOfNames(const Names& names) {
  return fmt::format("must be one of \"{}\"", fmt::join(names, "\", \""));
}

// `a`, `b` and `c`.
std::string Listed(const std::vector<schema::Visitor::Alternative>& alternatives) {
  std::string out;
  for (std::size_t i = 0; i < alternatives.size(); ++i) {
    if (i > 0) out += i + 1 == alternatives.size() ? " and " : ", ";
    out += fmt::format("`{}`", alternatives[i].key);
  }
  return out;
}

}  // namespace

std::string ReadTextFile(const std::filesystem::path& file) {
  try {
    return ReadRegularFile(file, kLargestFile_bytes);
  } catch (const UnreadableFile& error) {
    throw BadScene(fmt::format("{}: cannot be read: {}", Printable(file.string()), error.what()));
  }
}

TomlReader::TomlReader(const TomlValue& table, std::string path, SceneContext* context,
                       TomlValue* filled)
    : table_(&table), path_(std::move(path)), context_(context), filled_(filled) {
  if (table.kind != Kind::kTable)
    FailAt(path_, fmt::format("{}: must be a table", Describe(table)));
}

std::string TomlReader::PathOf(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

void TomlReader::FailAt(const std::string& path, const std::string& what) const {
  throw BadScene(fmt::format("{}: {}: {}", context_->name, path, what));
}

void TomlReader::Fail(std::string_view key, const std::string& what) {
  const TomlValue* value = Raw(key);
  FailAt(PathOf(key), value == nullptr ? what : fmt::format("{}: {}", Describe(*value), what));
}

const TomlValue* TomlReader::Raw(std::string_view key) {
  visited_.emplace(key);
  return table_->Find(key);
}

const TomlValue* TomlReader::Find(const Key& key, const std::string& needed) {
  const TomlValue* value = Raw(key.name);
  if (value == nullptr && key.presence == Presence::kRequired) {
    FailAt(PathOf(key.name), "is missing: " + needed);
  }
  return value;
}

void TomlReader::Fill(std::string_view key, TomlValue value) {
  if (filled_ != nullptr) filled_->Set(key, std::move(value));
}

double TomlReader::Convert(const TomlValue& value, const std::string& path, Quantity quantity,
                           Range range) {
  double number = value.number;
  if (value.kind == Kind::kText) {
    const auto parsed = ParseQuantity(value.text, quantity);
    if (!parsed) FailAt(path, Describe(value) + ": " + NeededNumber(quantity, range));
    number = *parsed;
  } else if (value.kind != Kind::kInteger && value.kind != Kind::kNumber) {
    FailAt(path, Describe(value) + ": " + NeededNumber(quantity, range));
  }
  const bool finite = std::isfinite(number);
  if (!finite || !range.Contains(number)) {
    const std::string_view unit = SiUnit(quantity);
    const std::string bound = BoundText(range);
    FailAt(path,
           fmt::format("{}{}{}: must be {}{}{}", number, unit.empty() ? "" : " ", unit,
                       finite ? "" : "finite", finite || bound.empty() ? "" : " and ", bound));
  }
  return number;
}

bool TomlReader::Number(const Key& key, Quantity quantity, Range range, double* value) {
  const TomlValue* raw = Find(key, NeededNumber(quantity, range));
  if (raw == nullptr) {
    // A default that may not be written stands for something that only absence says.
    const bool may = std::isfinite(*value) && range.Contains(*value);
    if (key.presence == Presence::kDefault && may) Fill(key.name, TomlNumber(*value));
    return false;
  }
  *value = Convert(*raw, PathOf(key.name), quantity, range);
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Integer(const Key& key, int low, int high, int* value) {
  const std::string needed = fmt::format("must be a whole number in [{}, {}]", low, high);
  const TomlValue* raw = Find(key, needed);
  if (raw == nullptr) {
    if (key.presence == Presence::kDefault) Fill(key.name, TomlInteger(*value));
    return false;
  }
  if (raw->kind != Kind::kInteger || raw->number < low || raw->number > high) {
    Fail(key.name, needed);
  }
  *value = static_cast<int>(raw->number);
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Boolean(const Key& key, bool* value) {
  const TomlValue* raw = Find(key, "must be true or false");
  if (raw == nullptr) {
    if (key.presence == Presence::kDefault) Fill(key.name, TomlBoolean(*value));
    return false;
  }
  if (raw->kind != Kind::kBoolean) Fail(key.name, "must be true or false");
  *value = raw->boolean;
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Text(const Key& key, std::string* value) {
  const TomlValue* raw = Find(key, "must be a text in quotes");
  if (raw == nullptr) {
    if (key.presence == Presence::kDefault) Fill(key.name, TomlText(*value));
    return false;
  }
  if (raw->kind != Kind::kText) Fail(key.name, "must be a text in quotes");
  *value = raw->text;
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Name(const Key& key, std::string* value) {
  const bool given = Text(key, value);
  Demand(IsName(*value), key.name, "must be made of letters, digits, _ and -");
  return given;
}

bool TomlReader::Numbers(const Key& key, Quantity quantity, Range range, int count,
                         std::vector<double>* values) {
  const bool empty_may = count == schema::kAnyCount;
  const std::string needed = fmt::format("must be an array of {} number{}",
                                         count >= 0  ? std::to_string(count)
                                         : empty_may ? "any"
                                                     : "one or more",
                                         count == 1 ? "" : "s");
  const TomlValue* raw = Find(key, needed);
  if (raw == nullptr) {
    if (key.presence == Presence::kDefault && !values->empty()) {
      Fill(key.name, TomlNumbers(*values));
    }
    return false;
  }
  if (raw->kind != Kind::kArray || (raw->items.empty() && !empty_may) ||
      (count >= 0 && static_cast<int>(raw->items.size()) != count)) {
    Fail(key.name, needed);
  }
  values->clear();
  for (std::size_t i = 0; i < raw->items.size(); ++i) {
    values->push_back(
        Convert(raw->items[i], fmt::format("{}[{}]", PathOf(key.name), i), quantity, range));
  }
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Matrix(const Key& key, Quantity quantity, schema::Matrix3* value) {
  const char* needed = "must be three rows of three numbers";
  const TomlValue* raw = Find(key, needed);
  if (raw == nullptr) return false;
  if (raw->kind != Kind::kArray || raw->items.size() != 3) Fail(key.name, needed);
  for (int i = 0; i < 3; ++i) {
    const TomlValue& row = raw->items[i];
    if (row.kind != Kind::kArray || row.items.size() != 3) Fail(key.name, needed);
    for (int j = 0; j < 3; ++j) {
      (*value)(i, j) = Convert(row.items[j], fmt::format("{}[{}][{}]", PathOf(key.name), i, j),
                               quantity, schema::kAnyValue);
    }
  }
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Pick(const Key& key, const Names& names, int* index) {
  const TomlValue* raw = Find(key, OneOfNames(names));
  if (raw == nullptr) {
    if (key.presence == Presence::kDefault && *index >= 0) {
      Fill(key.name, TomlText(std::string(names[*index])));
    }
    return false;
  }
  const auto at = std::find(names.begin(), names.end(), raw->text);
  if (raw->kind != Kind::kText || at == names.end()) Fail(key.name, OneOfNames(names));
  *index = static_cast<int>(at - names.begin());
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Reference(const Key& key, const std::vector<std::string>& names, int* index) {
  const std::string needed = names.empty()
                                 ? "must be one of: none in this scene"
                                 : fmt::format("must be one of: {}", fmt::join(names, ", "));
  const TomlValue* raw = Find(key, needed);
  if (raw == nullptr) {
    if (*index < 0) FailAt(PathOf(key.name), "is missing: " + needed);
    Fill(key.name, TomlText(names[*index]));
    return false;
  }
  const auto at = std::find(names.begin(), names.end(), raw->text);
  if (raw->kind != Kind::kText || at == names.end()) Fail(key.name, needed);
  *index = static_cast<int>(at - names.begin());
  Fill(key.name, *raw);
  return true;
}

std::optional<std::string> TomlReader::File(const Key& key) {
  std::string name;
  if (!Text(key, &name)) return std::nullopt;
  const std::string& folder = Raw(key.name)->folder;
  const std::filesystem::path file =
      (folder.empty() ? context_->directory : std::filesystem::path(folder)) / name;
  if (!folder.empty()) {
    Fill(key.name, TomlText(file.lexically_proximate(context_->directory).string()));
  }
  try {
    std::string text = ReadTextFile(file);
    context_->files_hash = Hash(text, context_->files_hash);
    context_->files.push_back(file);
    return text;
  } catch (const BadScene& error) {
    Fail(key.name, error.what());
  }
}

TomlValue TomlReader::Visit(const TomlValue& value, const std::string& path, const Body& body) {
  TomlValue filled;
  TomlReader inner(value, path, context_, filled_ == nullptr ? nullptr : &filled);
  body(inner);
  inner.Finish();
  return filled;
}

bool TomlReader::Table(const Key& key, const Body& body) {
  static const TomlValue kEmpty;
  const TomlValue* raw = Find(key, "must be a table");
  if (raw == nullptr && key.presence == Presence::kOptional) return false;
  Fill(key.name, Visit(raw == nullptr ? kEmpty : *raw, PathOf(key.name), body));
  return raw != nullptr;
}

bool TomlReader::Tables(const Key& key, const std::function<void(Visitor&, int)>& body) {
  const TomlValue* raw = Find(key, "must be an array of tables");
  if (raw == nullptr) return false;
  if (raw->kind != Kind::kArray) Fail(key.name, "must be an array of tables");
  TomlValue filled;
  filled.kind = Kind::kArray;
  for (std::size_t i = 0; i < raw->items.size(); ++i) {
    filled.items.push_back(Visit(raw->items[i], fmt::format("{}[{}]", PathOf(key.name), i),
                                 [&](Visitor& inner) { body(inner, static_cast<int>(i)); }));
  }
  Fill(key.name, std::move(filled));
  return true;
}

bool TomlReader::NamedTables(const Key& key, const Body& body) {
  return Table(key, [&](Visitor& inner) {
    const TomlValue& table = *table_->Find(key.name);
    for (const std::string& name : table.keys) inner.Table(schema::Required({name}), body);
  });
}

bool TomlReader::TableOrName(const Key& key, std::string_view of, const Body& body) {
  const TomlValue* raw = Find(key, fmt::format("must be a name from [{}] or a table", of));
  if (raw == nullptr || raw->kind != Kind::kText) return Table(key, body);
  const TomlValue* tables = context_->document == nullptr ? nullptr : context_->document->Find(of);
  const TomlValue* named = tables == nullptr ? nullptr : tables->Find(raw->text);
  if (named == nullptr) Fail(key.name, fmt::format("is not in [{}]", of));
  Visit(*named, fmt::format("{}.{}", of, raw->text), body);
  Fill(key.name, *raw);
  return true;
}

bool TomlReader::Switch(const Key& key, const Body& body) {
  const TomlValue* raw = Raw(key.name);
  if (raw != nullptr && raw->kind == Kind::kTable) return Table(key, body);
  if (raw != nullptr && raw->kind != Kind::kBoolean) {
    Fail(key.name, "must be true, false or a table of settings");
  }
  const bool on = raw != nullptr && raw->boolean;
  Fill(key.name, on ? Visit(TomlValue{}, PathOf(key.name), body) : TomlBoolean(false));
  return on;
}

void TomlReader::Either(const Key& key, schema::Form form, const Branch& if_form,
                        const Branch& otherwise) {
  const Kind kind = form == schema::Form::kTable   ? Kind::kTable
                    : form == schema::Form::kArray ? Kind::kArray
                                                   : Kind::kText;
  const TomlValue* raw = Raw(key.name);
  raw != nullptr && raw->kind == kind ? if_form() : otherwise();
}

void TomlReader::Cases(const Key& key, const Names& names, int* index,
                       const std::function<void(int)>& visit) {
  Pick(key, names, index);
  visit(*index);
}

void TomlReader::OneOf(std::string_view owner, bool none,
                       const std::vector<Alternative>& alternatives) {
  const std::string needed =
      none ? fmt::format("only one of {} may be given", Listed(alternatives))
           : fmt::format("{} must have exactly one of {}", owner, Listed(alternatives));
  const Alternative* chosen = nullptr;
  for (const Alternative& alternative : alternatives) {
    if (!Has(alternative.key)) continue;
    if (chosen != nullptr) Fail(alternative.key, needed);
    chosen = &alternative;
  }
  if (chosen != nullptr) {
    chosen->visit();
  } else if (!none) {
    Fail(alternatives.front().key, needed);
  }
}

void TomlReader::Demand(bool ok, std::string_view key, const std::string& what) {
  if (!ok) Fail(key, what);
}

void TomlReader::DemandAt(bool ok, std::string_view path, const std::string& what) {
  if (!ok) FailAt(PathOf(path), what);
}

void TomlReader::Finish() {
  for (const std::string& key : table_->keys) {
    if (visited_.contains(key)) continue;
    const std::string_view shown = std::string_view(key).substr(0, 80);
    const auto nearest =
        std::min_element(visited_.begin(), visited_.end(), [&](const auto& a, const auto& b) {
          return EditDistance(shown, a) < EditDistance(shown, b);
        });
    const bool near = nearest != visited_.end() &&
                      EditDistance(shown, *nearest) <= 1 + static_cast<int>(shown.size()) / 3;
    FailAt(PathOf(Printable(key)),
           near ? fmt::format("unknown key, did you mean \"{}\"?", *nearest)
                : fmt::format("unknown key, must be one of {}", fmt::join(visited_, ", ")));
  }
}

}  // namespace mantle::scene
