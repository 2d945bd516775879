#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <deque>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mantle::model {

/// Index of `name` among `names`. Throws std::invalid_argument, listing the known names, where
/// there is none; `what` says what they name.
template <typename Names>
int IndexOfName(const char* what, const Names& names, std::string_view name) {
  int index = 0;
  for (const auto& known : names) {
    if (known == name) return index;
    ++index;
  }
  throw std::invalid_argument(
      fmt::format("no {} is called \"{}\"; known: {}", what, name, fmt::join(names, ", ")));
}

/// What a program can make by the names that scenes use: `Type` has a `name` and a function `make`.
/// The first ones come along; a user's own are added. Not to be added to from several threads.
template <typename Type>
class NamedTypes {
 public:
  /// `what` says in errors what the names name.
  NamedTypes(const char* what, std::deque<Type> ours) : what_(what), types_(std::move(ours)) {}

  /// Throws std::invalid_argument where the name is no name (letters, digits, "_" and "-") or
  /// taken, or there is nothing to make.
  void Add(Type type) {
    const auto fits = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             c == '_' || c == '-';
    };
    if (type.name.empty() || !std::all_of(type.name.begin(), type.name.end(), fits)) {
      throw std::invalid_argument(
          fmt::format("{} \"{}\": a name has letters, digits, \"_\" and \"-\"", what_, type.name));
    }
    const std::vector<std::string> names = Names();
    if (std::find(names.begin(), names.end(), type.name) != names.end()) {
      throw std::invalid_argument(fmt::format("{} \"{}\": the name is taken", what_, type.name));
    }
    if (!type.make) {
      throw std::invalid_argument(fmt::format("{} \"{}\": nothing makes it", what_, type.name));
    }
    types_.push_back(std::move(type));
  }

  /// The entry of that name; stays good. Throws as IndexOfName.
  const Type& Find(std::string_view name) const {
    return types_[static_cast<std::size_t>(IndexOfName(what_, Names(), name))];
  }

  /// In the order of their registration.
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const Type& type : types_) names.push_back(type.name);
    return names;
  }

 private:
  const char* what_;
  std::deque<Type> types_;
};

}  // namespace mantle::model
