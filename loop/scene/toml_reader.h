#pragma once

#include <filesystem>
#include <initializer_list>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "loop/scene/regular_file.h"
#include "loop/scene/toml_document.h"
#include "loop/scene/units.h"
#include "model/lie.h"

/// Typed access to one table of a scene. Every key that is asked for is known, every other key is
/// an error; every message is one line that names scene, path, value, unit and bound:
///
///   scene.toml: arms[0].radius[1]: -0.006 m: must be > 0
///
/// All functions throw BadScene.

namespace mantle::scene {

using model::Matrix3;
using model::Vector3;
using model::Vector6;

/// Interval that a number must lie in.
struct Range {
  double low{-std::numeric_limits<double>::infinity()};
  double high{std::numeric_limits<double>::infinity()};
  bool low_open{false};

  bool Contains(double x) const { return (low_open ? x > low : x >= low) && x <= high; }
};
inline constexpr Range kAnyValue{};
inline constexpr Range kPositive{0, std::numeric_limits<double>::infinity(), true};
inline constexpr Range kNonNegative{0};
/// Most elements a body may have; beyond, a slip of the pen is more likely than a wish.
inline constexpr int kMaxElements = 100000;

/// What a whole scene shares while it is read.
struct SceneContext {
  std::string name;
  std::filesystem::path directory;       ///< of files that the scene names
  const TomlValue* materials{nullptr};   ///< the table [materials]
  std::set<std::string> known_keys;      ///< every key asked for, "arms.length"
  std::uint64_t files_hash{kEmptyHash};  ///< of the other files that the scene reads
};

class TomlReader {
 public:
  /// `path` is how messages name the table ("arms[0].cables[1]"), `schema` how the documentation
  /// does
  /// ("arms.cables"); both empty for the document.
  TomlReader(const TomlValue& table, std::string path, std::string schema, SceneContext* context);

  SceneContext& context() const { return *context_; }
  const std::string& path() const { return path_; }

  bool Has(std::string_view key);
  /// Value as written; null where absent.
  const TomlValue* Raw(std::string_view key);

  double Number(std::string_view key, Quantity quantity, Range range);
  double Number(std::string_view key, Quantity quantity, Range range, double fallback);
  std::optional<double> OptionalNumber(std::string_view key, Quantity quantity, Range range);
  int Integer(std::string_view key, int low, int high, int fallback);
  bool Boolean(std::string_view key, bool fallback);
  std::string Text(std::string_view key, std::string_view fallback);
  /// A name that can stand in a column's title: letters, digits, "_" and "-".
  std::string Name(std::string_view key, std::string_view fallback);

  /// Array of numbers; `count` < 0: any, at least one.
  std::vector<double> Numbers(std::string_view key, Quantity quantity, Range range, int count = -1);
  Vector3 Vector(std::string_view key, Quantity quantity, const Vector3& fallback);
  std::optional<Vector3> OptionalVector(std::string_view key, Quantity quantity);
  std::optional<Vector6> OptionalDiagonal(std::string_view key, Quantity quantity, Range range);
  Matrix3 Matrix(std::string_view key, Quantity quantity);
  /// Unit vector along the given one, which must not vanish.
  std::optional<Vector3> OptionalDirection(std::string_view key);

  template <typename T>
  T Choice(std::string_view key, std::initializer_list<std::pair<std::string_view, T>> choices,
           T fallback) {
    std::vector<std::string_view> names;
    for (const auto& choice : choices) names.push_back(choice.first);
    const int at = ChoiceIndex(key, names);
    return at < 0 ? fallback : (choices.begin() + at)->second;
  }

  std::optional<TomlReader> OptionalTable(std::string_view key);
  /// As OptionalTable, documented under another heading than schema.key (types used in many
  /// places).
  std::optional<TomlReader> OptionalTable(std::string_view key, std::string_view schema);
  TomlReader Table(std::string_view key);
  /// Array of tables; empty where absent.
  std::vector<TomlReader> Tables(std::string_view key);

  /// "scene: path.key: value: what".
  [[noreturn]] void Fail(std::string_view key, const std::string& what);
  /// Refuses keys that nobody asked for.
  void Finish();

 private:
  const TomlValue* table_;
  std::string path_, schema_;
  SceneContext* context_;
  std::set<std::string> asked_;

  std::string PathOf(std::string_view key) const;
  std::string SchemaOf(std::string_view key) const;
  int ChoiceIndex(std::string_view key, const std::vector<std::string_view>& names);
  double Convert(const TomlValue& value, const std::string& path, Quantity quantity, Range range);
  [[noreturn]] void FailAt(const std::string& path, const std::string& what) const;
};

}  // namespace mantle::scene
