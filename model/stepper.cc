#include "model/stepper.h"

namespace mantle::model {

int OrderOf(Integrator integrator) {
  switch (integrator) {
    case Integrator::kBackwardEuler:
      return 1;
    case Integrator::kSdirk2:
      return 2;
    case Integrator::kSdirk3:
      return 3;
    case Integrator::kRk4:
      return 4;
    case Integrator::kCvode:
      break;
  }
  return 0;
}

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
