#pragma once

#include <memory>
#include <optional>

#include "python/arrays.h"
#include "python/scene.h"
#include "reduced/build/projection.h"
#include "reduced/build/reduced_plant.h"
#include "reduced/build/simulation.h"
#include "reduced/step.h"

namespace mantle::python {

/// A reduced model that Python has: one of its own, or that of a run, which goes when the run ends.
/// With what its steps need, so that it serves one thread at a time: the one that holds the
/// interpreter.
class ModelHandle {
 public:
  /// Of a scene. Throws scene::BadScene.
  explicit ModelHandle(const LoadedScene& scene);
  /// Of a run that goes on; End() when it does no more.
  ModelHandle(const reduced::ReducedModel& model, const reduced::StepSettings& settings,
              double longest_step_s);

  void End();
  /// Throws tools::BadInput where the run has ended.
  const reduced::ReducedModel& model() const;
  /// Throws tools::BadInput where the model has no plant beside it, as that of a run.
  const reduced::ReducedPlant& plant_model() const;
  /// Where a run of the model starts.
  reduced::ReducedState Start() const;
  const reduced::StepSettings& settings() const { return settings_; }
  double longest_step_s() const { return longest_step_s_; }

  reduced::StepWork& step_work();
  reduced::ReducedWork& work();
  reduced::ReducedJacobians& jacobians();
  reduced::Projection& projection();

 private:
  std::unique_ptr<reduced::ReducedPlant> own_;
  const reduced::ReducedModel* model_;
  reduced::ReducedRunSettings run_;  ///< of its own model alone
  reduced::StepSettings settings_;
  double longest_step_s_;
  std::unique_ptr<reduced::StepWork> step_work_;
  std::unique_ptr<reduced::ReducedWork> work_;
  std::unique_ptr<reduced::ReducedJacobians> jacobians_;
  std::unique_ptr<reduced::Projection> projection_;
};

/// The model of a run for what Python code is given of it: gone from there when this goes.
struct RunModel {
  explicit RunModel(std::shared_ptr<ModelHandle> given) : handle(std::move(given)) {}
  ~RunModel() { handle->End(); }
  RunModel(const RunModel&) = delete;
  RunModel& operator=(const RunModel&) = delete;
  std::shared_ptr<ModelHandle> handle;
};

/// Index of an arm by its name; of the only arm where `name` is empty. Throws tools::BadInput.
int ArmOf(const reduced::ReducedModel& model, const std::string& name);

/// Of the model's inputs, in their order.
std::vector<std::string> MotorNames(const reduced::ReducedModel& model);

}  // namespace mantle::python
