#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/plant.h"
#include "model/stability.h"

/// @file
/// Equilibria of a robot with a held root under its loads at t = time, all scaled by the load
/// factor lambda (model/static_problem.h): a path of them, followed from rest. Load steps: each is
/// taken by Newton and kept only where the equilibrium continues the path (near where the tangent
/// pointed, with as many unstable directions), else halved. Arc length: along the path itself, over
/// limit points. Where the number of unstable directions changes on a path that goes on, there is a
/// bifurcation: the path stays on its primary branch, or leaves it for the stable one.

namespace mantle::model {

enum class StaticBranch {
  kPrimary,  ///< the continuation of the path from rest, be it unstable
  kStable    ///< at a bifurcation on to a stable branch
};

/// How a path of equilibria is followed: the table [statics] of a scene.
struct StaticsSettings {
  double time_s{0};           ///< at which schedules are evaluated
  int load_steps{10};         ///< to the full load; the first step of arc length
  bool arc_length{false};     ///< follow the path past limit points
  double max_load_factor{1};  ///< stop there; arc length also stops after passing a limit point
  int max_points{400};        ///< of an arc-length path; a path that needs more is incomplete
  bool stop_at_limit{true};   ///< arc length: stop once a limit point has been passed and located
  double tolerance{1e-10};    ///< on increments, in rad and body lengths
  int max_iterations{30};     ///< of Newton's method, for one point
  StaticBranch branch{StaticBranch::kPrimary};  ///< taken at a bifurcation
};

/// One equilibrium of the path.
struct StaticsPoint {
  double load_factor{0};
  double volume_m3{0};          ///< enclosed by the mantle
  std::vector<Vector3> tips_m;  ///< of the arms, world
  int unstable_directions{0};   ///< -1 where it could not be told
};

/// The path, where it ends, and the equilibrium there.
struct StaticsResult {
  bool ok{false};
  std::string reason;                       ///< why not, and what to do
  PlantState state;                         ///< last converged equilibrium
  double load_factor{0};                    ///< of that state
  std::optional<double> limit_load_factor;  ///< first maximum of lambda along the path
  /// Where the number of unstable directions changes: to a thousandth of a load step; to a point of
  /// the path on arc length and where loads have no potential.
  std::vector<double> bifurcation_load_factors;
  Stability stability;                         ///< of the state
  std::vector<std::string> without_potential;  ///< loads that make the tangent unsymmetric
  std::vector<StaticsPoint> path;
  int iterations{0};                                    ///< of Newton's method, in all
  std::vector<double> cable_length_m, cable_tension_n;  ///< as the inputs' cables
  double residual_n{0};        ///< largest unbalanced generalised force at the end [N, N m]
  double internal_force_n{0};  ///< largest that an element holds at the end [N, N m]
};

/// Throws BadRobot where the root is free. `progress` (may be empty) receives each point.
StaticsResult SolveStatics(const Plant& plant, const StaticsSettings& settings,
                           const std::function<void(const StaticsPoint&)>& progress = {});

}  // namespace mantle::model
