#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "loop/scene/regular_file.h"
#include "loop/scene/toml_document.h"
#include "loop/scene/units.h"
#include "model/schema.h"

namespace mantle::scene {

/// Text of a regular file of at most 64 MB. Throws BadScene, "FILE: cannot be read: why".
std::string ReadTextFile(const std::filesystem::path& file);

/// What a whole scene shares while it is read.
struct SceneContext {
  std::string name;                          ///< stands in messages
  std::filesystem::path directory;           ///< of files that the scene names
  const TomlValue* document{nullptr};        ///< the whole scene, for names of its entries
  std::vector<std::filesystem::path> files;  ///< that keys named and that were read
  std::uint64_t files_hash{kEmptyHash};      ///< of the bytes of those that keys named
};

/// Reads one table of a scene into the values that a description names, and writes out what it
/// read. Every key that the description visits is known, every other key is an error; every message
/// is one line that names scene, path, value, unit and bound:
///
///   scene.toml: arms[0].radius[1]: -0.006 m: must be > 0
class TomlReader final : public schema::Visitor {
 public:
  using schema::Visitor::Number;

  /// `path` is how messages name the table ("arms[0].cables[1]"), empty for the document.
  /// `filled`, where not null, becomes the same table with every default spelt out; what is there
  /// stays as the user wrote it.
  TomlReader(const TomlValue& table, std::string path, SceneContext* context, TomlValue* filled);

  bool describing() const override { return false; }

  // All throw BadScene.
  bool Number(const schema::Key& key, Quantity quantity, schema::Range range,
              double* value) override;
  bool Integer(const schema::Key& key, int low, int high, int* value) override;
  bool Boolean(const schema::Key& key, bool* value) override;
  bool Text(const schema::Key& key, std::string* value) override;
  bool Name(const schema::Key& key, std::string* value) override;
  bool Numbers(const schema::Key& key, Quantity quantity, schema::Range range, int count,
               std::vector<double>* values) override;
  bool Matrix(const schema::Key& key, Quantity quantity, schema::Matrix3* value) override;
  bool Pick(const schema::Key& key, const Names& names, int* index) override;
  bool Reference(const schema::Key& key, const std::vector<std::string>& names,
                 int* index) override;
  std::optional<std::string> File(const schema::Key& key) override;
  bool Table(const schema::Key& key, const Body& body) override;
  bool Tables(const schema::Key& key, const std::function<void(Visitor&, int)>& body) override;
  bool NamedTables(const schema::Key& key, const Body& body) override;
  bool TableOrName(const schema::Key& key, std::string_view of, const Body& body) override;
  bool Switch(const schema::Key& key, const Body& body) override;
  void Either(const schema::Key& key, schema::Form form, const Branch& if_form,
              const Branch& otherwise) override;
  void Cases(const schema::Key& key, const Names& names, int* index,
             const std::function<void(int)>& visit) override;
  void OneOf(std::string_view owner, bool none,
             const std::vector<Alternative>& alternatives) override;
  bool Has(std::string_view key) override { return Raw(key) != nullptr; }
  void Demand(bool ok, std::string_view key, const std::string& what) override;
  void DemandAt(bool ok, std::string_view path, const std::string& what) override;

  /// Refuses keys that no description visited. Call when the table has been visited.
  void Finish();

 private:
  const TomlValue* table_;
  std::string path_;
  SceneContext* context_;
  TomlValue* filled_;
  std::set<std::string> visited_;

  /// Value as written; null where absent.
  const TomlValue* Raw(std::string_view key);
  /// The same; where it is absent but required, fails with "is missing: `needed`".
  const TomlValue* Find(const schema::Key& key, const std::string& needed);
  void Fill(std::string_view key, TomlValue value);
  /// Visits `value` as the table at `path`; returns it with its defaults.
  TomlValue Visit(const TomlValue& value, const std::string& path, const Body& body);
  std::string PathOf(std::string_view key) const;
  double Convert(const TomlValue& value, const std::string& path, Quantity quantity,
                 schema::Range range);
  /// "scene: path.key: value: what".
  [[noreturn]] void Fail(std::string_view key, const std::string& what);
  [[noreturn]] void FailAt(const std::string& path, const std::string& what) const;
};

}  // namespace mantle::scene
