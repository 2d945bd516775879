#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/plant.h"

/// Equilibrium f(q, 0, lambda) = 0 of a clamped robot under its loads at t = time, all scaled by
/// the load factor lambda: Newton with load steps, or arc length (Crisfield's cylinder) past limit
/// points.

namespace mantle::model {

struct StaticsSettings {
  double time_s{0};  ///< at which schedules are evaluated
  int load_steps{10};
  bool arc_length{false};
  double max_load_factor{1};  ///< stop there; arc length also stops after passing a limit point
  int max_points{400};        ///< of the path
  bool stop_at_limit{true};   ///< arc length: stop once a limit point has been passed and located
  double tolerance{1e-10};    ///< on increments, in rad and body lengths
  int max_iterations{30};
};

struct StaticsPoint {
  double load_factor{0};
  double volume_m3{0};
  std::vector<Vector3> tips_m;  ///< of the arms
  int stability{1};             ///< sign of the determinant of the stiffness: -1 past a limit point
};

struct StaticsResult {
  bool ok{false};
  std::string reason;                       ///< why not
  PlantState state;                         ///< last converged equilibrium
  double load_factor{0};                    ///< of that state
  std::optional<double> limit_load_factor;  ///< first maximum of lambda along the path
  std::vector<StaticsPoint> path;
  int iterations{0};
  std::vector<double> cable_length_m, cable_tension_n;
  double residual_n{0};  ///< largest unbalanced generalised force at the end
};

/// Throws BadRobot where the root is not clamped. `progress` (may be empty) receives each point.
StaticsResult SolveStatics(const Plant& plant, const StaticsSettings& settings,
                           const std::function<void(const StaticsPoint&)>& progress = {});

}  // namespace mantle::model
