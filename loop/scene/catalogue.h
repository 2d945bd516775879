#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "loop/scene/toml_document.h"
#include "model/schema.h"

namespace mantle::scene {

struct Entry;

/// Keys that exclude each other.
struct Rivals {
  std::vector<std::string> keys;
  bool none{false};  ///< all of them may be absent
};

/// The keys of a table.
struct Keys {
  std::vector<Entry> entries;
  std::vector<Rivals> rivals;
};

/// One key of a table: what its description says of it.
struct Entry {
  enum class Kind {
    kNumber,
    kInteger,
    kBoolean,
    kText,
    kName,
    kNumbers,
    kMatrix,
    kChoice,
    kReference,  ///< name of another part
    kTable,
    kTables,
    kNamedTables,
    kTableOrName,
    kSwitch  ///< true, false or a table
  };

  Kind kind{Kind::kNumber};
  std::string name, meaning, fallback, bound, also, unit, type;  ///< as in schema::Key
  schema::Presence presence{schema::Presence::kDefault};
  schema::Quantity quantity{schema::Quantity::kNumber};
  schema::Range range;               ///< of a number, in SI
  int low{0}, high{0};               ///< of an integer
  int count{0};                      ///< of an array of numbers, as in Visitor::Numbers
  std::vector<std::string> choices;  ///< of a choice or a case
  std::optional<TomlValue> value;    ///< the default
  Keys keys;                         ///< of a table without `type`
  std::vector<Entry> otherwise;      ///< the other way to write the key, or none
  std::string only;                  ///< the case of the table that has this key, or empty
  /// Where this key says the table's case; the case that is the default may be left out.
  bool is_case{false};
};

/// Every key of a scene as data, made by visiting the descriptions with nothing to read. The key
/// tables of docs/scene.md and the JSON schema are written from it.
struct Catalogue {
  Keys scene;                         ///< of the document
  std::map<std::string, Keys> types;  ///< of tables that stand in several places, by heading
};

Catalogue MakeCatalogue(const std::function<void(schema::Visitor&)>& describe);

}  // namespace mantle::scene
