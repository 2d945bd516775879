#include "model/stepper.h"

namespace mantle::model {

std::unique_ptr<Stepper> MakeStepper(const Plant& plant, const StepperSettings& settings) {
  switch (settings.integrator) {
    case Integrator::kRk4:
      return MakeExplicitStepper(plant, settings);
    case Integrator::kCvode:
      return MakeCvodeStepper(plant, settings);
    default:
      return MakeImplicitStepper(plant, settings);
  }
}

}  // namespace mantle::model
