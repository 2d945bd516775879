#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mantle::reduced {

enum class BasisKind { kConstant, kLegendre };
enum class SectionRule {
  kGaussRadau,     ///< default: points per segment, one at its end
  kGaussLegendre,  ///< points per segment
  kPlantNodes      ///< the plant's own places of mass and elements: same semi-discrete arm
};

/// Which of torsion, bending y, z, stretch, shear y, z an arm may have.
using StrainChoice = std::array<bool, 6>;
inline constexpr StrainChoice kBending = {false, true, true, false, false, false};
inline constexpr StrainChoice kBendingTorsion = {true, true, true, false, false, false};
inline constexpr StrainChoice kFourStrains = {true, true, true, true, false, false};
inline constexpr StrainChoice kSixStrains = {true, true, true, true, true, true};

/// Which strains an arm keeps, and where its loads and inertia are summed.
struct ArmReduction {
  BasisKind basis{BasisKind::kConstant};
  int segments{4};                     ///< constant: equal segments, unless ends are given
  std::vector<double> segment_ends_m;  ///< ascending, the last one the arm's length
  int degree{3};                       ///< Legendre
  StrainChoice strains{kFourStrains};  ///< which vary; the others stay as at rest
  SectionRule rule{SectionRule::kGaussRadau};
  int points{3};  ///< per segment; for Legendre, per piece of 1/(degree + 1) of the arm
};

/// Which shapes the mantle keeps, and how finely its forces are summed over it.
struct MantleReduction {
  int modes{1};  ///< lowest vibration modes of the clamped mantle
  /// Pressures [Pa] on the actuated strip whose equilibria are shapes; several strips (or sets of
  /// spokes) give one shape each. Not given: 160 and 325 Pa, or two more modes where the mantle has
  /// no strip.
  std::optional<std::vector<double>> static_pressures_pa;
  /// Further shapes from a run of the plant itself: the leading ones (proper orthogonal
  /// decomposition, in the mantle's mass) of what the shapes above leave of the first
  /// `snapshot_time_s` seconds of the robot under its schedules.
  int snapshots{0};
  double snapshot_time_s{0.66};
  /// Elements whose stresses are evaluated are chosen, with weights, so that forces, stiffness and
  /// damping agree with the whole mesh within this share; 0 evaluates every element.
  double cubature_tolerance{1e-3};
  int lateral_slices{16};  ///< of the profile for lateral drag; 0: one per element
};

/// What one motor drives: the scene's cables, loads and strips, ganged with gains.
struct ActuatorTarget {
  enum class Kind { kCable, kDistributed, kPoint, kStrip, kNormalPressure };
  Kind kind{Kind::kCable};
  int index{0};  ///< into the PlantInputs' list of that kind
  double gain{1};
};
/// One motor: its targets take its value times their gains.
struct Actuator {
  std::string name;
  std::vector<ActuatorTarget> targets;
};

/// Index of the cable ARM.CABLE or MANTLE.SPOKES in the plant's order, as PlantInputs and targets
/// of motors count them. Throws std::invalid_argument, listing the known names, where there is
/// none.
int FindCable(const model::Robot& robot, std::string_view name);

enum class StepScheme { kSdirk2, kBackwardEuler };

/// How a robot is reduced ([physics.md] 8): plain values that a scene's table [reduced] gives and
/// reduced/ builds from.
struct Reduction {
  std::vector<ArmReduction> arms{ArmReduction{}};  ///< one per arm, or one for all
  MantleReduction mantle;
  /// Empty: one per cable, distributed load and strip, in the plant's order.
  std::vector<Actuator> actuators;
  StepScheme scheme{StepScheme::kSdirk2};
  double step_s{0.05};     ///< longest; steps also end at output times and break points
  double tolerance{1e-9};  ///< of a step's Newton iteration, see StepSettings
};

}  // namespace mantle::reduced
