#pragma once

#include <functional>
#include <string_view>
#include <vector>

/// Derivative-free minimisation within the unit box. The one door to NLopt.

namespace mantle::tools {

enum class SearchMethod {
  kSubplex,  ///< Rowan's simplexes in subspaces, local
  kBobyqa,   ///< Powell's quadratic models in a trust region, local
  kCrs       ///< controlled random search with local mutation, global; seeded
};
inline constexpr std::string_view kSearchMethods[] = {"subplex", "bobyqa", "crs"};

struct SearchResult {
  std::vector<double> x;
  double value{0};
  int evaluations{0};
};

/// Begins at `start` (in [0, 1] each) with first steps of `step`, and again at the best point found
/// until `evaluations` are used or a whole search gains less than a thousandth. `objective` returns
/// a finite value; what it throws is thrown on. `stop` is asked before every evaluation. The same
/// arguments give the same bits.
SearchResult Minimise(SearchMethod method, const std::vector<double>& start, double step,
                      int evaluations,
                      const std::function<double(const std::vector<double>&)>& objective,
                      const std::function<bool()>& stop);

}  // namespace mantle::tools
