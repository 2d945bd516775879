#include "controller/registry.h"

#include "controller/baselines.h"
#include "model/named_types.h"

namespace mantle::controller {
namespace {

model::NamedTypes<ControllerType>& Controllers() {
  const auto baseline = [](ControllerKind kind, bool uses_disturbance) {
    return ControllerType{
        std::string(ToString(kind)),
        [kind](const ControllerParts& parts) { return MakeBaseline(parts, kind); },
        uses_disturbance};
  };
  static model::NamedTypes<ControllerType> registry(
      "controller", {{std::string(ToString(ControllerKind::kMpc)), MakeMpcController},
                     baseline(ControllerKind::kGait, false),
                     baseline(ControllerKind::kPursuit, false),
                     baseline(ControllerKind::kPid, false),
                     baseline(ControllerKind::kLqr, true)});
  return registry;
}

model::NamedTypes<EstimatorType>& Estimators() {
  static model::NamedTypes<EstimatorType> registry(
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
  for (const reduced::Actuator& motor : motors) names.push_back(motor.name);
  return model::IndexOfName("motor", names, name);
}

}  // namespace mantle::controller
