#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>

/// Compares an analytic Jacobian with differences and prints the entries that are wrong.
///
///   df/dx_j ~ (8 (f(x + h_j) - f(x - h_j)) - (f(x + 2 h_j) - f(x - 2 h_j))) / (12 h_j)
/// Truncation h^4 f^(5)/30, round-off about 1.5 eps |f|/h: with h = 1e-3 of the scale on which f
/// changes, entries are good to about 1e-11 of their row.

namespace mantle::tests {

/// d/dt of f(t) at t = 0 with step h; f returns a number or a vector.
template <typename Function>
auto DifferenceRate(const Function& f, double h) {
  using Value = decltype(f(0.0));
  const Value first = f(h) - f(-h);
  const Value second = f(2.0 * h) - f(-2.0 * h);
  return Value((8.0 * first - second) / (12.0 * h));
}

/// Jacobian of f (VectorX to a vector, or to a number) with steps h per coordinate.
template <typename Function>
Eigen::MatrixXd DifferenceJacobian(const Function& f, const Eigen::VectorXd& x,
                                   const Eigen::VectorXd& h) {
  Eigen::MatrixXd jacobian;
  for (int j = 0; j < x.size(); ++j) {
    const auto along = [&](double t) {
      Eigen::VectorXd y = x;
      y(j) += t;
      return f(y);
    };
    if constexpr (std::is_same_v<decltype(along(0.0)), double>) {
      if (j == 0) jacobian.resize(1, x.size());
      jacobian(0, j) = DifferenceRate(along, h(j));
    } else {
      const Eigen::VectorXd column = DifferenceRate(along, h(j));
      if (j == 0) jacobian.resize(column.size(), x.size());
      jacobian.col(j) = column;
    }
  }
  return jacobian;
}

/// Success if every entry agrees within `tolerance` times the scale of its row and column:
/// |a - b| <= tolerance sqrt(max |row| max |column|) + floor.
inline testing::AssertionResult JacobianMatches(const Eigen::MatrixXd& analytic,
                                                const Eigen::MatrixXd& numeric, double tolerance,
                                                double floor = 0.0) {
  if (analytic.rows() != numeric.rows() || analytic.cols() != numeric.cols()) {
    return testing::AssertionFailure()
           << fmt::format("{}x{} against {}x{}", analytic.rows(), analytic.cols(), numeric.rows(),
                          numeric.cols());
  }
  const Eigen::VectorXd rows = numeric.cwiseAbs().rowwise().maxCoeff();
  const Eigen::VectorXd columns = numeric.cwiseAbs().colwise().maxCoeff().transpose();
  constexpr int kPrinted = 12;
  int wrong = 0;
  double worst = 0;
  std::string text;
  for (int i = 0; i < numeric.rows(); ++i) {
    for (int j = 0; j < numeric.cols(); ++j) {
      const double scale = std::sqrt(rows(i) * columns(j));
      const double error = std::abs(analytic(i, j) - numeric(i, j));
      if (error <= tolerance * scale + floor) continue;  // NaN fails
      worst = std::max(worst, error / std::max(scale, 1e-300));
      if (++wrong <= kPrinted) {
        text += fmt::format("\n  ({}, {}): analytic {:.12g}, differences {:.12g}, scale {:.3g}", i,
                            j, analytic(i, j), numeric(i, j), scale);
      }
    }
  }
  if (wrong == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure() << fmt::format(
             "{} of {} entries differ by more than {:.1e} of their scale (worst {:.2e}):{}", wrong,
             numeric.size(), tolerance, worst, text);
}

}  // namespace mantle::tests
