#include "loop/scene/toml_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mantle::scene {
namespace {

using Kind = TomlValue::Kind;

std::string BoundOf(Range range) {
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  if (low && high)
    return fmt::format(" in {}{}, {}]", range.low_open ? '(' : '[', range.low, range.high);
  if (low) return fmt::format(" {} {}", range.low_open ? ">" : ">=", range.low);
  if (high) return fmt::format(" <= {}", range.high);
  return "";
}

std::string WantedNumber(Quantity quantity, Range range) {
  const std::string units = UnitsOf(quantity);
  return fmt::format("must be a number{}{}", BoundOf(range),
                     units.empty() ? "" : " with unit " + units + " (a bare number is SI)");
}

int EditDistance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int up = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = up;
    }
  }
  return row.back();
}

}  // namespace

TomlReader::TomlReader(const TomlValue& table, std::string path, std::string schema,
                       SceneContext* context)
    : table_(&table), path_(std::move(path)), schema_(std::move(schema)), context_(context) {
  if (table.kind != Kind::kTable)
    FailAt(path_, fmt::format("{}: must be a table", Describe(table)));
}

std::string TomlReader::PathOf(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

std::string TomlReader::SchemaOf(std::string_view key) const {
  return schema_.empty() ? std::string(key) : fmt::format("{}.{}", schema_, key);
}

void TomlReader::FailAt(const std::string& path, const std::string& what) const {
  throw BadScene(fmt::format("{}: {}: {}", context_->name, path, what));
}

void TomlReader::Fail(std::string_view key, const std::string& what) {
  const TomlValue* value = Raw(key);
  FailAt(PathOf(key), value == nullptr ? what : fmt::format("{}: {}", Describe(*value), what));
}

const TomlValue* TomlReader::Raw(std::string_view key) {
  asked_.emplace(key);
  context_->known_keys.insert(SchemaOf(key));
  return table_->Find(key);
}

bool TomlReader::Has(std::string_view key) { return Raw(key) != nullptr; }

double TomlReader::Convert(const TomlValue& value, const std::string& path, Quantity quantity,
                           Range range) {
  double number = value.number;
  if (value.kind == Kind::kText) {
    const auto parsed = ParseQuantity(value.text, quantity);
    if (!parsed) FailAt(path, Describe(value) + ": " + WantedNumber(quantity, range));
    number = *parsed;
  } else if (value.kind != Kind::kInteger && value.kind != Kind::kNumber) {
    FailAt(path, Describe(value) + ": " + WantedNumber(quantity, range));
  }
  if (!std::isfinite(number) || !range.Contains(number)) {
    const std::string_view unit = SiUnit(quantity);
    const std::string bound = BoundOf(range);
    FailAt(path, fmt::format("{}{}{}: must be{}{}", number, unit.empty() ? "" : " ", unit,
                             std::isfinite(number) ? "" : " finite",
                             std::isfinite(number) || bound.empty() ? bound : " and" + bound));
  }
  return number;
}

double TomlReader::Number(std::string_view key, Quantity quantity, Range range) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) FailAt(PathOf(key), "is missing: " + WantedNumber(quantity, range));
  return Convert(*value, PathOf(key), quantity, range);
}

double TomlReader::Number(std::string_view key, Quantity quantity, Range range, double fallback) {
  return OptionalNumber(key, quantity, range).value_or(fallback);
}

std::optional<double> TomlReader::OptionalNumber(std::string_view key, Quantity quantity,
                                                 Range range) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) return std::nullopt;
  return Convert(*value, PathOf(key), quantity, range);
}

int TomlReader::Integer(std::string_view key, int low, int high, int fallback) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) return fallback;
  if (value->kind != Kind::kInteger || value->number < low || value->number > high) {
    Fail(key, fmt::format("must be a whole number in [{}, {}]", low, high));
  }
  return static_cast<int>(value->number);
}

bool TomlReader::Boolean(std::string_view key, bool fallback) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) return fallback;
  if (value->kind != Kind::kBoolean) Fail(key, "must be true or false");
  return value->boolean;
}

std::string TomlReader::Text(std::string_view key, std::string_view fallback) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) return std::string(fallback);
  if (value->kind != Kind::kText) Fail(key, "must be a text in quotes");
  return value->text;
}

std::string TomlReader::Name(std::string_view key, std::string_view fallback) {
  const std::string name = Text(key, fallback);
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
  if (name.empty() || !plain) Fail(key, "must be made of letters, digits, _ and -");
  return name;
}

std::vector<double> TomlReader::Numbers(std::string_view key, Quantity quantity, Range range,
                                        int count) {
  const std::string wanted =
      fmt::format("must be an array of {} number{}",
                  count < 0 ? "one or more" : std::to_string(count), count == 1 ? "" : "s");
  const TomlValue* value = Raw(key);
  if (value == nullptr) Fail(key, "is missing: " + wanted);
  if (value->kind != Kind::kArray || value->items.empty() ||
      (count >= 0 && static_cast<int>(value->items.size()) != count)) {
    Fail(key, wanted);
  }
  std::vector<double> out;
  for (std::size_t i = 0; i < value->items.size(); ++i) {
    out.push_back(Convert(value->items[i], fmt::format("{}[{}]", PathOf(key), i), quantity, range));
  }
  return out;
}

std::optional<Vector3> TomlReader::OptionalVector(std::string_view key, Quantity quantity) {
  if (!Has(key)) return std::nullopt;
  const auto n = Numbers(key, quantity, kAnyValue, 3);
  return Vector3(n[0], n[1], n[2]);
}

Vector3 TomlReader::Vector(std::string_view key, Quantity quantity, const Vector3& fallback) {
  return OptionalVector(key, quantity).value_or(fallback);
}

std::optional<Vector6> TomlReader::OptionalDiagonal(std::string_view key, Quantity quantity,
                                                    Range range) {
  if (!Has(key)) return std::nullopt;
  const auto n = Numbers(key, quantity, range, 6);
  return Vector6(n.data());
}

Matrix3 TomlReader::Matrix(std::string_view key, Quantity quantity) {
  const TomlValue* value = Raw(key);
  if (value == nullptr || value->kind != Kind::kArray || value->items.size() != 3) {
    Fail(key, "must be three rows of three numbers");
  }
  Matrix3 m;
  for (int i = 0; i < 3; ++i) {
    const TomlValue& row = value->items[i];
    if (row.kind != Kind::kArray || row.items.size() != 3) {
      Fail(key, "must be three rows of three numbers");
    }
    for (int j = 0; j < 3; ++j) {
      m(i, j) =
          Convert(row.items[j], fmt::format("{}[{}][{}]", PathOf(key), i, j), quantity, kAnyValue);
    }
  }
  return m;
}

std::optional<Vector3> TomlReader::OptionalDirection(std::string_view key) {
  const auto v = OptionalVector(key, Quantity::kNumber);
  if (v && !(v->norm() > 0)) Fail(key, "must not be the zero vector");
  if (!v) return std::nullopt;
  return v->normalized();
}

int TomlReader::ChoiceIndex(std::string_view key, const std::vector<std::string_view>& names) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) return -1;
  const auto at = std::find(names.begin(), names.end(), value->text);
  if (value->kind != Kind::kText || at == names.end()) {
    Fail(key, fmt::format("must be one of \"{}\"", fmt::join(names, "\", \"")));
  }
  return static_cast<int>(at - names.begin());
}

std::optional<TomlReader> TomlReader::OptionalTable(std::string_view key) {
  return OptionalTable(key, SchemaOf(key));
}

std::optional<TomlReader> TomlReader::OptionalTable(std::string_view key, std::string_view schema) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) return std::nullopt;
  return TomlReader(*value, PathOf(key), std::string(schema), context_);
}

TomlReader TomlReader::Table(std::string_view key) {
  const TomlValue* value = Raw(key);
  if (value == nullptr) FailAt(PathOf(key), "is missing: must be a table");
  return TomlReader(*value, PathOf(key), SchemaOf(key), context_);
}

std::vector<TomlReader> TomlReader::Tables(std::string_view key) {
  const TomlValue* value = Raw(key);
  std::vector<TomlReader> out;
  if (value == nullptr) return out;
  if (value->kind != Kind::kArray) Fail(key, "must be an array of tables");
  for (std::size_t i = 0; i < value->items.size(); ++i) {
    out.emplace_back(value->items[i], fmt::format("{}[{}]", PathOf(key), i), SchemaOf(key),
                     context_);
  }
  return out;
}

void TomlReader::Finish() {
  for (const std::string& key : table_->keys) {
    if (asked_.contains(key)) continue;
    const auto nearest = std::min_element(
        asked_.begin(), asked_.end(),
        [&](const auto& a, const auto& b) { return EditDistance(key, a) < EditDistance(key, b); });
    const bool near = nearest != asked_.end() &&
                      EditDistance(key, *nearest) <= 1 + static_cast<int>(key.size()) / 3;
    FailAt(PathOf(key),
           near ? fmt::format("unknown key, did you mean \"{}\"?", *nearest)
                : fmt::format("unknown key, must be one of {}", fmt::join(asked_, ", ")));
  }
}

}  // namespace mantle::scene
