#include "loop/scene/catalogue.h"

#include <cmath>

namespace mantle::scene {
namespace {

using schema::Key;
using schema::Presence;
using schema::Quantity;
using schema::Range;

class Cataloguer final : public schema::Visitor {
 public:
  using schema::Visitor::Number;

  Cataloguer(Keys* keys, Catalogue* all) : keys_(keys), all_(all) {}

  bool describing() const override { return true; }

  bool Number(const Key& key, Quantity quantity, Range range, double* value) override {
    Entry& entry = Add(key, Entry::Kind::kNumber);
    entry.quantity = quantity;
    entry.range = range;
    const bool may = std::isfinite(*value) && range.Contains(*value);
    if (key.presence == Presence::kDefault && may) entry.value = TomlNumber(*value);
    return false;
  }
  bool Integer(const Key& key, int low, int high, int* value) override {
    Entry& entry = Add(key, Entry::Kind::kInteger);
    entry.low = low;
    entry.high = high;
    if (key.presence == Presence::kDefault) entry.value = TomlInteger(*value);
    return false;
  }
  bool Boolean(const Key& key, bool* value) override {
    Add(key, Entry::Kind::kBoolean).value = TomlBoolean(*value);
    return false;
  }
  bool Text(const Key& key, std::string* value) override {
    Entry& entry = Add(key, Entry::Kind::kText);
    if (key.presence == Presence::kDefault) entry.value = TomlText(*value);
    return false;
  }
  bool Name(const Key& key, std::string* value) override {
    Entry& entry = Add(key, Entry::Kind::kName);
    if (!value->empty()) entry.value = TomlText(*value);
    return false;
  }
  bool Numbers(const Key& key, Quantity quantity, Range range, int count,
               std::vector<double>* values) override {
    Entry& entry = Add(key, Entry::Kind::kNumbers);
    entry.quantity = quantity;
    entry.range = range;
    entry.count = count;
    if (key.presence == Presence::kDefault && !values->empty()) {
      entry.value = TomlNumbers(*values);
    }
    return false;
  }
  bool Matrix(const Key& key, Quantity quantity, schema::Matrix3*) override {
    Add(key, Entry::Kind::kMatrix).quantity = quantity;
    return false;
  }
  bool Pick(const Key& key, const Names& names, int* index) override {
    Entry& entry = Add(key, Entry::Kind::kChoice);
    entry.choices.assign(names.begin(), names.end());
    if (key.presence == Presence::kDefault && *index >= 0) {
      entry.value = TomlText(entry.choices[*index]);
    }
    return false;
  }
  bool Reference(const Key& key, const std::vector<std::string>&, int*) override {
    Add(key, Entry::Kind::kReference);
    return false;
  }
  std::optional<std::string> File(const Key& key) override {
    Add(key, Entry::Kind::kText);
    return std::nullopt;
  }

  bool Table(const Key& key, const Body& body) override {
    return AddTable(key, Entry::Kind::kTable, body);
  }
  bool Tables(const Key& key, const std::function<void(Visitor&, int)>& body) override {
    return AddTable(key, Entry::Kind::kTables, [&](Visitor& inner) { body(inner, 0); });
  }
  bool NamedTables(const Key& key, const Body& body) override {
    return AddTable(key, Entry::Kind::kNamedTables, body);
  }
  bool TableOrName(const Key& key, std::string_view, const Body& body) override {
    return AddTable(key, Entry::Kind::kTableOrName, body);
  }
  bool Switch(const Key& key, const Body& body) override {
    return AddTable(key, Entry::Kind::kSwitch, body);
  }

  void Either(const Key& key, schema::Form, const Branch& if_form,
              const Branch& otherwise) override {
    Keys first, second;
    Keys* const before = keys_;
    keys_ = &first;
    if_form();
    keys_ = &second;
    otherwise();
    keys_ = before;
    Entry entry = first.entries.at(0);
    entry.otherwise = second.entries;
    entry.type = key.type;
    keys_->entries.push_back(std::move(entry));
  }
  void Cases(const Key& key, const Names& names, int* index,
             const std::function<void(int)>& visit) override {
    Pick(key, names, index);
    keys_->entries.back().is_case = true;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::size_t from = keys_->entries.size();
      visit(static_cast<int>(i));
      for (std::size_t k = from; k < keys_->entries.size(); ++k) {
        keys_->entries[k].only = names[i];
      }
    }
  }
  void OneOf(std::string_view, bool none, const std::vector<Alternative>& alternatives) override {
    Rivals& rivals = keys_->rivals.emplace_back();
    rivals.none = none;
    for (const Alternative& alternative : alternatives) {
      const std::size_t at = keys_->entries.size();
      alternative.visit();
      keys_->rivals.back().keys.emplace_back(alternative.key);
      Entry& entry = keys_->entries.at(at);
      entry.presence = Presence::kOptional;
      entry.value.reset();
    }
  }

  bool Has(std::string_view) override { return false; }
  void Demand(bool, std::string_view, const std::string&) override {}
  void DemandAt(bool, std::string_view, const std::string&) override {}

 private:
  Keys* keys_;
  Catalogue* all_;

  Entry& Add(const Key& key, Entry::Kind kind) {
    Entry& entry = keys_->entries.emplace_back();
    entry.kind = kind;
    entry.name = key.name;
    entry.meaning = key.meaning;
    entry.fallback = key.fallback;
    entry.bound = key.bound;
    entry.also = key.also;
    entry.unit = key.unit;
    entry.type = key.type;
    entry.presence = key.presence;
    return entry;
  }

  bool AddTable(const Key& key, Entry::Kind kind, const Body& body) {
    Add(key, kind);
    Keys own;
    Cataloguer inner(&own, all_);
    body(inner);
    if (key.type.empty()) {
      keys_->entries.back().keys = std::move(own);
    } else {
      all_->types.try_emplace(std::string(key.type), std::move(own));
    }
    return false;
  }
};

}  // namespace

Catalogue MakeCatalogue(const std::function<void(schema::Visitor&)>& describe) {
  Catalogue catalogue;
  Cataloguer cataloguer(&catalogue.scene, &catalogue);
  describe(cataloguer);
  return catalogue;
}

}  // namespace mantle::scene
