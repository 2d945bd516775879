#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/plant.h"

/// @file
/// How far a computed shape can be trusted: what the model's assumptions (a linear material law, a
/// mantle that stays axisymmetric) would not show by themselves. What no solid can do at all is
/// refused by the plant's evaluation.

namespace mantle::model {

/// A strain beyond this is outside what a linear law holds for in an elastomer: the secant modulus
/// of silicones is off by tens of per cent there.
inline constexpr double kLargeStrain = 0.3;

/// The largest strain of a robot, and where it is.
struct LargestStrain {
  double value{0};               ///< absolute, of a fibre
  std::string body;              ///< empty where the robot has no soft body
  double x_m{0};                 ///< arc length at rest
  std::optional<double> time_s{};  ///< of a run
};

/// Largest fibre strain at the state of the last evaluation. Arms: stretch with the bending at the
/// section's edge, or shear with the torsion there (centreline strains alone where the arm's
/// stiffness is given as numbers, since its radius is then nominal); mantle: meridional or hoop
/// strain at the inner or outer face, or transverse shear.
LargestStrain FindLargestStrain(const Plant& plant, const PlantWork& work);

/// Classical pressures at which a tube of the mantle's largest radius R, thickness t = 2h and
/// meridian length L goes into lobes under uniform external pressure (R. von Mises, VDI-Z 58, 1914;
/// D. F. Windenburg, C. Trilling, Trans. ASME 56, 1934), alpha = pi R / L:
///
///   p = E t / (R (n^2 - 1)) [alpha^4 / (n^2 + alpha^2)^2 +
///                            t^2 (n^2 + alpha^2 - 1)^2 / (12 R^2 (1 - nu^2))]
///
/// with its ends held round; alpha -> 0, n = 2 where nothing holds them. The axisymmetric model
/// cannot see this.
struct LobedBuckling {
  double free_pa{0};  ///< nothing holds the ends round: E t^3 / (4 (1 - nu^2) R^3)
  double held_pa{0};  ///< both ends held round
  int held_lobes{2};  ///< n at held_pa
};
LobedBuckling FindLobedBuckling(const Shell& shell);

/// Largest inward pressure on the mantle [Pa]: strips, spokes at these tensions (in the plant's
/// order of cables), and a negative inner pressure, added up where strips overlap.
double InwardPressure(const Plant& plant, const PlantInputs& inputs,
                      const std::vector<double>& cable_tension_n);

/// The mantle's pressures: working, and those of its lobes.
struct LobedBucklingMargin {
  LobedBuckling lobes;
  double working_pa{0};
  std::optional<double> time_s{};  ///< of a run
};

/// The largest of these over a run, as numbers that a checkpoint can hold.
class ValidityRecord {
 public:
  /// Takes in a state, by its evaluation.
  void Add(const Plant& plant, const PlantInputs& inputs, const PlantWork& work, double time_s);
  LargestStrain strain(const Plant& plant) const;
  /// Nothing without a mantle.
  std::optional<LobedBucklingMargin> lobed_buckling(const Plant& plant) const;

 private:
  double strain_{-1}, body_{-1}, x_m_{0}, strain_time_s_{0};
  double working_pa_{0}, working_time_s_{0};
};

/// One line each, with figures and what to do; empty where nothing is to be said.
std::vector<std::string> StrainWarnings(const LargestStrain& strain);
std::vector<std::string> LobedBucklingWarnings(const LobedBucklingMargin& margin);

}  // namespace mantle::model
