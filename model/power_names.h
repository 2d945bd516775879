#pragma once

#include <string>
#include <vector>

namespace mantle::model {

/// Names under which loads report their power ("weight", "drag.arm1", "jet_thrust", ...). A load
/// keeps the place that its name has here, so that no account looks names up or counts along lists;
/// loads that share a name share the place.
class PowerNames {
 public:
  /// Place of `name`, made where it is new.
  int Place(const std::string& name) {
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (names_[i] == name) return static_cast<int>(i);
    }
    names_.push_back(name);
    return static_cast<int>(names_.size()) - 1;
  }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
};

}  // namespace mantle::model
