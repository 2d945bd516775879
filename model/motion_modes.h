#pragma once

#include <complex>
#include <vector>

#include "model/plant.h"

/// @file
/// The linearised motion about a state of rest, with viscosity, drag under a current, added mass
/// and loads that follow the body:
///
///   M zeta'' = (D - M ad_eta) zeta' + (K + D ad_eta) zeta,    zeta = x exp(lambda t)
///
/// K = df/dzeta, D = df/dv, eta the twist of a body at rest in the frame that drifts with the water
/// (model/newton_matrix.h, FactorAtRest). The eigenvalues nearest to zero come from Arnoldi's
/// iteration on the shift-inverted companion form, O(N) per vector (Y. Saad, Numerical Methods for
/// Large Eigenvalue Problems, 2011, 6.2 and 10.1.1).

namespace mantle::model {

/// One motion x exp(lambda t) about the state of rest: a damped vibration, an overdamped
/// relaxation, or a growing one.
struct MotionMode {
  std::complex<double> rate_1_s;  ///< lambda; of a conjugate pair the one with imaginary part >= 0
  Eigen::VectorXcd shape;         ///< laid out as v; its largest entry is 1

  double frequency_hz() const;   ///< |Im lambda| / 2 pi; 0 where it does not oscillate
  double damping_ratio() const;  ///< -Re lambda / |lambda|
  /// Grows: the real part stands out from the round-off of the eigenvalue.
  bool unstable() const;
};

/// How well eigenvalues must have converged. Kelvin-Voigt materials have clusters of overdamped
/// ones (at -E / 3 eta), which Arnoldi's iteration cannot tell apart; where only growth matters, it
/// need not.
enum class MotionAccuracy {
  kFull,  ///< to nine digits
  kSign   ///< the sign of their real parts is certain
};

/// The `count` modes nearest to lambda = 0 (fewer if the mesh has fewer), nearest first. `rest`
/// holds the velocities of a body at rest. A free root's rigid motions come first, with rates of
/// zero to the square root of round-off. Throws std::runtime_error where the stiffness is singular
/// or the iteration does not converge.
std::vector<MotionMode> MotionModes(const Plant& plant, const PlantState& rest,
                                    const PlantInputs& inputs, int count,
                                    MotionAccuracy accuracy = MotionAccuracy::kFull);

}  // namespace mantle::model
