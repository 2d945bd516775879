#pragma once

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/lie.h"

/// @file
/// How an owner of options describes them, once. Beside its struct it has a function
///
///   void Describe(schema::Visitor& v, Gait& gait) {
///     v.Number({"period", "of the pulses"}, Quantity::kTime, kPositive, &gait.period_s);
///   }
///
/// that names each key with its unit, bound and meaning; what the value holds before the visit is
/// the default. A scene is read, checked and written back, its documentation and its JSON schema
/// are made by visitors (loop/scene/) of these descriptions alone. A visitor that only records
/// keys (`describing()`) takes every branch and leaves values as they are; one that reads throws
/// where the user's value is wrong.

namespace mantle::schema {

using model::Matrix3;
using model::Vector3;
using model::Vector6;

/// What a number means; loop/scene/units.h has the units that people may write.
enum class Quantity {
  kNumber,
  kLength,
  kTime,
  kMass,
  kAngle,
  kForce,
  kMoment,
  kForcePerLength,
  kMomentPerLength,
  kPressure,
  kViscosity,
  kDensity,
  kSpeed,
  kAngularSpeed,
  kAcceleration,
  kFrequency,
  kCurvature,
  kStiffness,
  kDamping,
  kArea,
  kVolume,
  kInertia,
  kRollDrag,
  kSectionStiffness,  ///< diagonal of N m^2 (first three) and N (last three)
  kSectionDamping,    ///< N m^2 s and N s
  kSectionInertia     ///< kg m and kg/m
};

/// Interval that a number must lie in.
struct Range {
  double low{-std::numeric_limits<double>::infinity()};
  double high{std::numeric_limits<double>::infinity()};
  bool low_open{false};  ///< `low` itself is not allowed

  bool Contains(double x) const { return (low_open ? x > low : x >= low) && x <= high; }
};
inline constexpr Range kAnyValue{};
inline constexpr Range kPositive{0, std::numeric_limits<double>::infinity(), true};
inline constexpr Range kNonNegative{0};
/// Times by which a run advances, steps and periods: one of 1e-300 s would never end.
inline constexpr Range kTimeStep{1e-9};
inline constexpr Range kShare{0, 1};

/// What the absence of a key means.
enum class Presence {
  kDefault,   ///< the default; a table is then as an empty one
  kRequired,  ///< an error
  kOptional   ///< that there is nothing of the kind
};

/// A key and the words that its documentation needs beyond what the call itself says.
struct Key {
  std::string_view name{};
  std::string_view meaning{};
  std::string_view fallback{};  ///< the default in words, where no value says it ("file name")
  std::string_view bound{};     ///< the bound in words, where it depends on other keys
  std::string_view also{};      ///< a condition besides the bound ("needed by `jet_thrust`")
  std::string_view unit{};      ///< unit of a plain number that has no Quantity ("1/m^2")
  std::string_view type{};      ///< of a table that stands in several places: its heading ("pose")
  Presence presence{Presence::kDefault};
};
inline Key Required(Key key) {
  key.presence = Presence::kRequired;
  return key;
}
inline Key Optional(Key key) {
  key.presence = Presence::kOptional;
  return key;
}

/// How many numbers an array holds, where that is not one count.
inline constexpr int kOneOrMore = -1, kAnyCount = -2;

/// How a value is written, for keys that may be written in two ways.
enum class Form { kTable, kArray, kText };

/// Visits the keys of one table. Every function that takes a key and a value returns true where the
/// user gave the key; the value is then what the user wrote, in SI.
class Visitor {
 public:
  using Branch = std::function<void()>;
  using Body = std::function<void(Visitor&)>;
  using Names = std::vector<std::string_view>;
  /// One of several keys that exclude each other, and the visit that reads it.
  struct Alternative {
    std::string_view key;
    Branch visit;
  };

  virtual ~Visitor() = default;

  /// True where nothing is read: keys are recorded, values stay defaults.
  virtual bool describing() const = 0;

  virtual bool Number(const Key& key, Quantity quantity, Range range, double* value) = 0;
  virtual bool Integer(const Key& key, int low, int high, int* value) = 0;
  virtual bool Boolean(const Key& key, bool* value) = 0;
  virtual bool Text(const Key& key, std::string* value) = 0;
  /// A text that can stand in a column's title: letters, digits, "_" and "-".
  virtual bool Name(const Key& key, std::string* value) = 0;
  /// `count` numbers, or kOneOrMore, kAnyCount; an empty array before the visit is no default.
  virtual bool Numbers(const Key& key, Quantity quantity, Range range, int count,
                       std::vector<double>* values) = 0;
  /// Three rows of three.
  virtual bool Matrix(const Key& key, Quantity quantity, Matrix3* value) = 0;
  /// One of `names`; -1 before the visit is no default.
  virtual bool Pick(const Key& key, const Names& names, int* index) = 0;
  /// The name of another part of the scene, one of `names`.
  virtual bool Reference(const Key& key, const std::vector<std::string>& names, int* index) = 0;
  /// The text of a file that the key names, beside the scene.
  virtual std::optional<std::string> File(const Key& key) = 0;

  virtual bool Table(const Key& key, const Body& body) = 0;
  /// An array of tables; `body` sees each with its index.
  virtual bool Tables(const Key& key, const std::function<void(Visitor&, int)>& body) = 0;
  /// A table whose keys are free names of tables.
  virtual bool NamedTables(const Key& key, const Body& body) = 0;
  /// A table, or the name of an entry of the scene's NamedTables `of`.
  virtual bool TableOrName(const Key& key, std::string_view of, const Body& body) = 0;
  /// True (the table's defaults), false, or a table; returns whether it is on.
  virtual bool Switch(const Key& key, const Body& body) = 0;

  /// A key that is written as `form` or otherwise: one of two visits of the same key.
  virtual void Either(const Key& key, Form form, const Branch& if_form,
                      const Branch& otherwise) = 0;
  /// One of `names`, each with further keys of this table that `visit` visits.
  virtual void Cases(const Key& key, const Names& names, int* index,
                     const std::function<void(int)>& visit) = 0;
  /// Keys that exclude each other; `owner` ("a cable") must have one, or (`none`) may.
  virtual void OneOf(std::string_view owner, bool none,
                     const std::vector<Alternative>& alternatives) = 0;

  /// True where the user gave the key. False while describing.
  virtual bool Has(std::string_view key) = 0;
  /// Refuses the value of `key` unless `ok`.
  virtual void Demand(bool ok, std::string_view key, const std::string& what) = 0;
  /// Refuses unless `ok`, naming a path below this table, whatever is written there.
  virtual void DemandAt(bool ok, std::string_view path, const std::string& what) = 0;

  // Made of the above.

  bool Number(const Key& key, Quantity quantity, Range range, std::optional<double>* value) {
    double number = 0;
    if (!Number(Optional(key), quantity, range, &number)) return false;
    *value = number;
    return true;
  }
  bool Vector(const Key& key, Quantity quantity, Range range, Vector3* value) {
    std::vector<double> n(value->data(), value->data() + 3);
    const bool given = Numbers(key, quantity, range, 3, &n);
    *value = Vector3(n.data());
    return given;
  }
  bool Vector(const Key& key, Quantity quantity, Range range, std::optional<Vector3>* value) {
    std::vector<double> n;
    if (!Numbers(Optional(key), quantity, range, 3, &n)) return false;
    *value = Vector3(n.data());
    return true;
  }
  bool Diagonal(const Key& key, Quantity quantity, Range range, std::optional<Vector6>* value) {
    std::vector<double> n;
    if (!Numbers(Optional(key), quantity, range, 6, &n)) return false;
    *value = Vector6(n.data());
    return true;
  }
  /// A vector that must not vanish, made a unit vector.
  bool Direction(Key key, Vector3* value) {
    key.also = "not zero";
    if (!Vector(key, Quantity::kNumber, kAnyValue, value)) return false;
    Demand(value->norm() > 0, key.name, "must not be the zero vector");
    value->normalize();
    return true;
  }
  template <typename T>
  bool Choice(const Key& key, std::initializer_list<std::pair<std::string_view, T>> choices,
              T* value) {
    Names names;
    int index = -1;
    for (const auto& choice : choices) {
      if (choice.second == *value) index = static_cast<int>(names.size());
      names.push_back(choice.first);
    }
    const bool given = Pick(key, names, &index);
    if (index >= 0) *value = (choices.begin() + index)->second;
    return given;
  }
  /// A table that the function Describe of its type describes.
  template <typename T>
  bool Object(const Key& key, T* value) {
    return Table(key, [value](Visitor& table) { Describe(table, *value); });
  }
  /// An effect with settings, absent where it is off.
  template <typename T>
  void Effect(const Key& key, std::optional<T>* effect) {
    T settings;
    if (Switch(key, [&](Visitor& table) { Describe(table, settings); })) *effect = settings;
  }
};

/// One of the names that are known now; `value` holds the default.
inline void PickName(Visitor& v, const Key& key, const std::vector<std::string>& known,
                     std::string* value) {
  const auto at = std::find(known.begin(), known.end(), *value);
  int index = at == known.end() ? -1 : static_cast<int>(at - known.begin());
  v.Pick(key, Visitor::Names(known.begin(), known.end()), &index);
  if (index >= 0) *value = known[static_cast<std::size_t>(index)];
}

}  // namespace mantle::schema
