#include "controller/controller.h"

namespace mantle::controller {

std::unique_ptr<Controller> MakeController(const ControllerParts& parts) {
  return MakeMpcController(parts);
}

}  // namespace mantle::controller
