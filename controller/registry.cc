#include "controller/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <stdexcept>

#include "controller/baselines.h"

namespace mantle::controller {
namespace {

// References to its entries stay good.
template <typename Type>
class Registry {
 public:
  Registry(const char* what, std::deque<Type> ours) : what_(what), types_(std::move(ours)) {}

  void Add(Type type) {
    const auto fits = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             c == '_' || c == '-';
    };
    if (type.name.empty() || !std::all_of(type.name.begin(), type.name.end(), fits)) {
      throw std::invalid_argument(
          fmt::format("{} \"{}\": a name has letters, digits, \"_\" and \"-\"", what_, type.name));
    }
    if (At(type.name) != types_.end()) {
      throw std::invalid_argument(fmt::format("{} \"{}\": the name is taken", what_, type.name));
    }
    if (!type.make) {
      throw std::invalid_argument(fmt::format("{} \"{}\": nothing makes it", what_, type.name));
    }
    types_.push_back(std::move(type));
  }

  const Type& Find(std::string_view name) const {
    const auto found = At(name);
    if (found != types_.end()) return *found;
    throw std::invalid_argument(
        fmt::format("no {} is called \"{}\"; known: {}", what_, name, fmt::join(Names(), ", ")));
  }

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const Type& type : types_) names.push_back(type.name);
    return names;
  }

 private:
  typename std::deque<Type>::const_iterator At(std::string_view name) const {
    return std::find_if(types_.begin(), types_.end(),
                        [&](const Type& type) { return type.name == name; });
  }

  const char* what_;
  std::deque<Type> types_;
};

Registry<ControllerType>& Controllers() {
  const auto baseline = [](ControllerKind kind, bool uses_disturbance) {
    return ControllerType{
        std::string(ToString(kind)),
        [kind](const ControllerParts& parts) { return MakeBaseline(parts, kind); },
        uses_disturbance};
  };
  static Registry<ControllerType> registry(
      "controller", {{std::string(ToString(ControllerKind::kMpc)), MakeMpcController},
                     baseline(ControllerKind::kGait, false),
                     baseline(ControllerKind::kPursuit, false),
                     baseline(ControllerKind::kPid, false),
                     baseline(ControllerKind::kLqr, true)});
  return registry;
}

Registry<EstimatorType>& Estimators() {
  static Registry<EstimatorType> registry(
      "estimator", {{EstimatorOptions{}.type, [](const EstimatorParts& parts) {
                       return std::make_unique<ModelEstimator>(parts);
                     }}});
  return registry;
}

}  // namespace

void RegisterController(ControllerType type) { Controllers().Add(std::move(type)); }
void RegisterEstimator(EstimatorType type) { Estimators().Add(std::move(type)); }
const ControllerType& FindController(std::string_view name) { return Controllers().Find(name); }
const EstimatorType& FindEstimator(std::string_view name) { return Estimators().Find(name); }
std::vector<std::string> ControllerNames() { return Controllers().Names(); }
std::vector<std::string> EstimatorNames() { return Estimators().Names(); }

std::unique_ptr<Controller> MakeController(const ControllerParts& parts) {
  return FindController(parts.options.controller).make(parts);
}

std::unique_ptr<Estimator> MakeEstimator(const EstimatorParts& parts) {
  return FindEstimator(parts.options.type).make(parts);
}

int FindMotor(const std::vector<reduced::Actuator>& motors, std::string_view name) {
  std::vector<std::string_view> names;
  for (const reduced::Actuator& motor : motors) {
    if (motor.name == name) return static_cast<int>(names.size());
    names.push_back(motor.name);
  }
  throw std::invalid_argument(
      fmt::format("no motor is called \"{}\"; known: {}", name, fmt::join(names, ", ")));
}

}  // namespace mantle::controller
