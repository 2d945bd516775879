#include "controller/controller.h"

#include "controller/baselines.h"

namespace mantle::controller {

std::unique_ptr<Controller> MakeController(const ControllerParts& parts) {
  const ControllerKind kind = parts.options.controller;
  return kind == ControllerKind::kMpc ? MakeMpcController(parts) : MakeBaseline(parts, kind);
}

}  // namespace mantle::controller
