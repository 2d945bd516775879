#pragma once

#include "reduced/reduced_model.h"

namespace mantle::controller {

using model::VectorX;
using reduced::ReducedModel;
using reduced::ReducedState;

/// When a state is so far from another that what was linearised about the one says nothing of the
/// other: a plan is then made anew from where the vehicle is. With d = (zeta, dq, dv) between them,
///
///   largest |d_i| / s_i > 1,
///
/// s: half a radian and a quarter of a body length of the root; bends of 3 rad and a stretch of 0.3
/// over an arm, twenty times the mantle's own scale; and the same in a twentieth of a second for
/// their rates.
class Parting {
 public:
  explicit Parting(const ReducedModel& model);

  /// The largest share; above 1 they are apart. Infinite where one is not finite. No allocation.
  double Share(const ReducedState& from, const ReducedState& to);
  bool Apart(const ReducedState& from, const ReducedState& to) { return !(Share(from, to) <= 1.0); }

 private:
  VectorX inverse_, difference_;
};

}  // namespace mantle::controller
