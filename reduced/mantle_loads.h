#pragma once

#include "reduced/mantle.h"

/// The loads of model/mantle_loads.h on the reduced mantle: their laws, projected on its shapes.
///
/// AddToResidual subtracts a load from R_s (work->residual) and R_root (work->root_wrench);
/// AddToTangent its derivatives, rows and columns from `first` on being the mantle's.

namespace mantle::reduced {

void AddToResidual(const model::NormalPressureLoad& load, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work);
void AddToResidual(const model::JetLoad& load, const ReducedMantle& m, const MantleMotion& motion,
                   MantleWork* work);
void AddToResidual(const model::AxialDragLoad& load, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work);
void AddToResidual(const model::LateralDragLoad& load, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work);
void AddToResidual(const model::WallGravityLoad& load, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work);
void AddToResidual(const model::OutflowLoad& load, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work);
inline void AddToResidual(const model::WallWaterAccelerationLoad& load, const ReducedMantle& m,
                          const MantleMotion& motion, MantleWork* work) {
  MantleMotion at_full_load = motion;  // not a field that load stepping scales
  at_full_load.field_scale = 1.0;
  AddToResidual(load.AsGravity(motion.water_acceleration_m_s2), m, at_full_load, work);
}

void AddToTangent(const model::NormalPressureLoad& load, const ReducedMantle& m,
                  const MantleMotion& motion, int first, MantleWork* work, Linearisation* out);
void AddToTangent(const model::JetLoad& load, const ReducedMantle& m, const MantleMotion& motion,
                  int first, MantleWork* work, Linearisation* out);
void AddToTangent(const model::AxialDragLoad& load, const ReducedMantle& m,
                  const MantleMotion& motion, int first, MantleWork* work, Linearisation* out);
void AddToTangent(const model::LateralDragLoad& load, const ReducedMantle& m,
                  const MantleMotion& motion, int first, MantleWork* work, Linearisation* out);
void AddToTangent(const model::WallGravityLoad& load, const ReducedMantle& m,
                  const MantleMotion& motion, int first, MantleWork* work, Linearisation* out);
inline void AddToTangent(const model::WallWaterAccelerationLoad& load, const ReducedMantle& m,
                         const MantleMotion& motion, int first, MantleWork* work,
                         Linearisation* out) {
  MantleMotion at_full_load = motion;
  at_full_load.field_scale = 1.0;
  AddToTangent(load.AsGravity(motion.water_acceleration_m_s2), m, at_full_load, first, work, out);
}
/// With those of the water's inertia instead, whose terms it shares: AddOutflowTangent.
inline void AddToTangent(const model::OutflowLoad&, const ReducedMantle&, const MantleMotion&, int,
                         MantleWork*, Linearisation*) {}
void AddOutflowTangent(const ReducedMantle& m, const MantleMotion& motion, int first,
                       MantleWork* work, Linearisation* out);

}  // namespace mantle::reduced
