#include "reduced/quadrature.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace mantle::reduced {
namespace {

constexpr int kScan = 40;        // sub-intervals per root when roots are bracketed
constexpr int kBisections = 60;  // to round-off

void Check(int n) {
  if (n < 1 || n > kMaxQuadraturePoints) {
    throw std::invalid_argument("quadrature points = " + std::to_string(n) + ", must be in [1, " +
                                std::to_string(kMaxQuadraturePoints) + "]");
  }
}

// Roots of f in (-1, 1), ascending; evenly scanned in the angle acos(x), where they are well apart.
template <typename Function>
std::vector<double> Roots(int count, Function f) {
  std::vector<double> roots;
  const int steps = kScan * (count + 1);
  const auto x_of = [&](int i) { return -std::cos(M_PI * (i + 0.25) / (steps + 0.5)); };
  for (int i = 0; i < steps; ++i) {
    double a = x_of(i), b = x_of(i + 1);
    if (f(a) * f(b) > 0.0) continue;
    for (int k = 0; k < kBisections; ++k) {
      const double m = 0.5 * (a + b);
      (f(a) * f(m) <= 0.0 ? b : a) = m;
    }
    roots.push_back(0.5 * (a + b));
  }
  return roots;
}

}  // namespace

void LegendrePolynomials(int degree, double x, double* values) {
  values[0] = 1.0;
  if (degree == 0) return;
  values[1] = x;
  for (int k = 2; k <= degree; ++k) {
    values[k] = ((2 * k - 1) * x * values[k - 1] - (k - 1) * values[k - 2]) / k;
  }
}

QuadratureRule GaussLegendre(int n) {
  Check(n);
  QuadratureRule rule;
  std::vector<double> p(n + 1);
  const auto value = [&](double x) {
    LegendrePolynomials(n, x, p.data());
    return p[n];
  };
  for (double x : Roots(n, value)) {
    LegendrePolynomials(n, x, p.data());
    const double slope = n * (x * p[n] - p[n - 1]) / (x * x - 1.0);
    rule.point.push_back(0.5 * (1.0 + x));
    rule.weight.push_back(1.0 / ((1.0 - x * x) * slope * slope));
  }
  return rule;
}

QuadratureRule GaussRadau(int n) {
  Check(n);
  // With the end at x = -1 (Abramowitz & Stegun 25.4.31): zeros of (P_{n-1} + P_n)/(1 + x);
  // mirrored.
  QuadratureRule rule;
  std::vector<double> p(n + 1);
  const auto value = [&](double x) {
    LegendrePolynomials(n, x, p.data());
    return (p[n - 1] + p[n]) / (1.0 + x);
  };
  const std::vector<double> roots = n > 1 ? Roots(n - 1, value) : std::vector<double>();
  for (auto x = roots.rbegin(); x != roots.rend(); ++x) {
    LegendrePolynomials(n, *x, p.data());
    rule.point.push_back(0.5 * (1.0 - *x));
    rule.weight.push_back(0.5 * (1.0 - *x) / (n * n * p[n - 1] * p[n - 1]));
  }
  rule.point.push_back(1.0);
  rule.weight.push_back(1.0 / (n * n));
  return rule;
}

}  // namespace mantle::reduced
