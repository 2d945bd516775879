#pragma once

#include <array>

#include "model/stepper.h"

/// Singly diagonally implicit Runge-Kutta methods, L-stable and stiffly accurate (Alexander 1977):
/// a method of p stages has order p, and its last stage is the step.
///
/// Along a linear problem the local error in v is C h^(p+1) v^(p+1) (Hairer & Wanner II, IV.3:
/// R(z) - e^z = C z^(p+1) + ..., C the coefficient of z^(p+1) in e^z (1 - gamma z)^p, but for its
/// sign). The rates at the step's start and its stages are v_dot and sum_k (A^k 1)_i z^k v_dot,
/// from which the weights w of the error follow: sum_i w_i (A^k 1)_i = 0 for k < p, and C for k =
/// p.

namespace mantle::model {

/// Coefficients of one method; the derivation is above.
struct Sdirk {
  int stages;
  double gamma;
  double error_constant;        ///< |C|
  std::array<double, 4> error;  ///< w: of the rate at the start, and of the stages'
  std::array<double, 3> c;
  std::array<std::array<double, 3>, 3> a;  ///< the last row is b
};

/// kSdirk2, kSdirk3 or kBackwardEuler.
Sdirk SdirkOf(Integrator kind);

}  // namespace mantle::model
