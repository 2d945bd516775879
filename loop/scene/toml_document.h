#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// @file
/// A parsed TOML text as plain values, and overrides on it. The only part that knows the TOML
/// library.

namespace mantle::scene {

/// What a user wrote that cannot be: one line, "scene.toml: path: value: bound".
struct BadScene : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// A TOML value. A table's `keys` run parallel to its `items`.
struct TomlValue {
  enum class Kind { kBoolean, kInteger, kNumber, kText, kArray, kTable, kDate };

  Kind kind{Kind::kTable};
  bool boolean{false};
  double number{0};  ///< of integers too
  std::string text;
  std::string folder;  ///< of a text: of the file that holds it, where that is not the scene's
  std::vector<std::string> keys;  ///< of a table
  std::vector<TomlValue> items;   ///< of an array or a table

  const TomlValue* Find(std::string_view key) const;
  TomlValue* Find(std::string_view key);
  /// Of a table: replaces the key's value or adds it at the end.
  void Set(std::string_view key, TomlValue value);
  /// Of a table: removes the key where it is there.
  void Remove(std::string_view key);
};

TomlValue TomlBoolean(bool value);
TomlValue TomlInteger(int value);
TomlValue TomlNumber(double value);
TomlValue TomlText(std::string value);
TomlValue TomlNumbers(const std::vector<double>& values);

/// Short rendering for messages ("[1, 2]", "\"soft\"", "a table").
std::string Describe(const TomlValue& value);

/// Throws BadScene, "name: line 3, column 7: ..."; also where the text is not UTF-8 or a key has
/// more than kMaxKeyParts parts, which recursion below would not survive.
TomlValue ParseToml(std::string_view text, const std::string& name);

inline constexpr int kMaxKeyParts = 32;

/// The document as TOML: ParseToml reads the same values back, bit for bit. Dates are not kept.
std::string WriteToml(const TomlValue& document);

/// Notes in all texts of the document the folder of the file that holds them.
void NoteFolder(const std::string& folder, TomlValue* document);

/// Puts `over` on top of `base`: tables key by key, everything else whole.
void MergeToml(const TomlValue& over, TomlValue* base);

/// Applies "dotted.path=value" to a document. An array of tables is entered by index or by the
/// `name` of its element: `arms[0].elements=40`, `arms.arm.elements=40`. The value is TOML; what is
/// not valid TOML is taken as a string (`time.step=5 ms`). Missing tables and keys are made, so
/// that the reader can say what is unknown. Throws BadScene, also for what ParseToml refuses.
void ApplyOverride(std::string_view override_text, TomlValue* document);

}  // namespace mantle::scene
