#pragma once

#include <optional>
#include <span>
#include <vector>

/// Observed orders of convergence, and which points of a study no other point beats.

namespace mantle::tools {

/// One run of a family: how coarse it is (a step [s], or 1 / elements), and its error.
struct ConvergencePoint {
  double size{0}, error{0};
};

/// error = constant (size^order - reference^order), `reference` the size of the reference.
struct OrderFit {
  double order{0}, constant{0};
  int points{0};                  ///< fitted
  double coarsest{0}, finest{0};  ///< their sizes
  double scatter{0};              ///< root mean square of ln(error / fit)
  /// Size at which the fit expects `error`.
  double SizeFor(double error) const;
};

/// How a family converges: least squares in logarithms over all sizes with errors in
/// [floor, ceiling]. Empty where fewer than three have such errors. `reference_size` 0: the
/// reference is exact.
std::optional<OrderFit> FitOrder(std::vector<ConvergencePoint> points, double reference_size,
                                 double floor, double ceiling);

/// The largest size whose error, and that of every finer one, is at most `target`: interpolated
/// between neighbours in logarithms. 0 where even the finest has more.
double LargestSizeWithin(std::vector<ConvergencePoint> points, double target);

/// Of points (cost, error), the indices of those that no other point beats in both, by cost.
std::vector<int> ParetoFront(std::span<const double> cost, std::span<const double> error);

}  // namespace mantle::tools
