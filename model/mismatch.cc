#include "model/mismatch.h"

namespace mantle::model {
namespace {

void Scale(const Mismatch& m, Material* material) {
  material->young_pa *= m.young;
  material->viscosity_pa_s *= m.viscosity;
}

}  // namespace

Robot WithActualBodies(const Robot& described) {
  Robot robot = described;
  Mismatch& m = robot.mismatch;
  for (Arm& arm : robot.arms) {
    Scale(m, &arm.material);
    if (arm.stiffness) *arm.stiffness *= m.young;
    if (arm.viscosity) *arm.viscosity *= m.viscosity;
    arm.added_mass_coefficient *= m.added_mass;
    for (ArmPiece& piece : arm.pieces) {
      Scale(m, &piece.material);
      if (piece.stiffness) *piece.stiffness *= m.young;
      if (piece.viscosity) *piece.viscosity *= m.viscosity;
    }
  }
  if (robot.mantle) {
    Scale(m, &robot.mantle->material);
    robot.mantle->added_mass_coefficient *= m.added_mass;
  }
  m.young = m.viscosity = m.added_mass = 1.0;
  return robot;
}

}  // namespace mantle::model
