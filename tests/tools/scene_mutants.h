#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

/// Scenes that are wrong in the ways in which scenes go wrong: shipped ones with numbers, units,
/// types, keys, tables and bytes changed, one to four changes each. The same seed gives the same
/// mutants.

namespace mantle::testing_tools {

class SceneMutants {
 public:
  /// `scenes` are texts of scenes from which mutants are made, and values and lines drawn.
  SceneMutants(std::vector<std::string> scenes, std::uint64_t seed);

  std::string Next();
  /// What was done to the last one, for a report: "number, key renamed".
  const std::string& changes() const { return changes_; }

 private:
  struct Span {
    std::size_t at, size;
  };

  void Mutate(std::string* text);
  void ChangeNumber(std::string* text);
  void ChangeText(std::string* text);
  void ChangeType(std::string* text);
  void RenameKey(std::string* text);
  void MoveLines(std::string* text);
  void Nest(std::string* text);
  void ChangeBytes(std::string* text);

  std::size_t Draw(std::size_t below);
  template <typename List>
  const auto& Pick(const List& list) {
    return list[Draw(std::size(list))];
  }
  /// Places in `text` that `pattern` matches, its first group where it has one; none: an empty span
  /// at the end.
  Span Find(const std::string& text, const char* pattern);

  std::vector<std::string> scenes_, texts_;
  std::mt19937_64 random_;
  std::string changes_;
};

}  // namespace mantle::testing_tools
