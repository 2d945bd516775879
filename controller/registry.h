#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "controller/controller.h"
#include "controller/estimator.h"

/// @file
/// Controllers and estimators by the names that scenes use. Ours are there from the beginning; one
/// of a user's own is registered before the scene that names it is read:
///
///   RegisterController({"mine", [](const ControllerParts& parts) {
///     return std::make_unique<MyController>(parts);
///   }});
///   ... [control] controller = "mine"
///
/// Not to be called from several threads at once.

namespace mantle::controller {

/// A controller that scenes may name: control.controller = "NAME".
struct ControllerType {
  std::string name;  ///< letters, digits, "_" and "-"
  std::function<std::unique_ptr<Controller>(const ControllerParts&)> make;
  /// It takes account of Disturbance; else none is estimated for it, but where that helps to
  /// filter.
  bool uses_disturbance{true};
};

/// An estimator that scenes may name: control.estimator.type = "NAME".
struct EstimatorType {
  std::string name;  ///< letters, digits, "_" and "-"
  std::function<std::unique_ptr<Estimator>(const EstimatorParts&)> make;
};

/// Throw std::invalid_argument where the name is no name or taken, or there is nothing to make.
void RegisterController(ControllerType type);
void RegisterEstimator(EstimatorType type);

/// Throw std::invalid_argument, listing the known names, where there is none of that name.
const ControllerType& FindController(std::string_view name);
const EstimatorType& FindEstimator(std::string_view name);

/// In the order of their registration.
std::vector<std::string> ControllerNames();
std::vector<std::string> EstimatorNames();

/// Index of the motor of that name among `motors`, as in tensions and commands. Throws
/// std::invalid_argument, listing the known names, where there is none.
int FindMotor(const std::vector<reduced::Actuator>& motors, std::string_view name);

}  // namespace mantle::controller
