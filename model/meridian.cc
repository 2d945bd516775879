#include "model/meridian.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "model/rod.h"

namespace mantle::model {

double MeridianLength(const Mantle& mantle) {
  double length = 0;
  for (const MeridianPiece& p : mantle.pieces) length += p.length_m;
  return length;
}

MeridianPoint MeridianAt(const Mantle& mantle, double x_m) {
  MeridianPoint at{mantle.r0_m, mantle.z0_m, mantle.theta0_rad};
  for (const MeridianPiece& p : mantle.pieces) {
    const double s = std::min(x_m, p.length_m);
    // Chord of an arc: s sinc(k s / 2), along the mean direction.
    const double half = 0.5 * p.curvature_1_m * s;
    const double sinc = std::abs(half) < 1e-4 ? 1.0 - half * half / 6.0 : std::sin(half) / half;
    at.r_m += s * sinc * std::cos(at.theta_rad + half);
    at.z_m += s * sinc * std::sin(at.theta_rad + half);
    at.theta_rad += 2.0 * half;
    x_m -= s;
    if (x_m <= 0) break;
  }
  return at;
}

std::vector<double> MeridianNodes(const Mantle& mantle) {
  const double length = MeridianLength(mantle);
  std::vector<double> fixed = {0.0, length};
  double x = 0;
  for (const MeridianPiece& p : mantle.pieces) fixed.push_back(x += p.length_m);
  fixed.insert(fixed.end(), mantle.stations_m.begin(), mantle.stations_m.end());
  for (const StripPressure& s : mantle.strips) fixed.insert(fixed.end(), {s.from_m, s.to_m});
  for (const SpokeCable& s : mantle.spokes) fixed.insert(fixed.end(), {s.from_m, s.to_m});
  std::sort(fixed.begin(), fixed.end());
  fixed.erase(std::unique(fixed.begin(), fixed.end(),
                          [&](double a, double b) { return b - a < 1e-9 * length; }),
              fixed.end());
  const int stretches = static_cast<int>(fixed.size()) - 1;
  if (mantle.elements < stretches) {
    throw BadRobot(
        fmt::format("elements = {}, must be >= {}: the meridian's pieces, strips and "
                    "stations need a node at each of their ends",
                    mantle.elements, stretches));
  }
  // Element size h(X) ~ 1 + (grading - 1) X / L; count(X) = integral of dX / h, inverted exactly.
  const double g = mantle.grading - 1.0;
  const auto count = [&](double s) {
    return std::abs(g) < 1e-9 ? s / length : std::log1p(g * s / length) / g;
  };
  const auto inverse = [&](double c) {
    return std::abs(g) < 1e-9 ? c * length : std::expm1(g * c) / g * length;
  };
  // Share the elements among the stretches by largest remainder, one at least for each.
  std::vector<double> ideal(stretches);
  std::vector<int> share(stretches);
  const double total = count(length);
  for (int i = 0; i < stretches; ++i) {
    ideal[i] = mantle.elements * (count(fixed[i + 1]) - count(fixed[i])) / total;
    share[i] = std::max(1, static_cast<int>(ideal[i]));
  }
  int missing = mantle.elements - std::accumulate(share.begin(), share.end(), 0);
  while (missing != 0) {
    const int step = missing > 0 ? 1 : -1;
    int best = -1;
    for (int i = 0; i < stretches; ++i) {
      if (step < 0 && share[i] == 1) continue;
      if (best < 0 || step * (ideal[i] - share[i]) > step * (ideal[best] - share[best])) best = i;
    }
    share[best] += step;
    missing -= step;
  }
  std::vector<double> nodes = {0.0};
  for (int i = 0; i < stretches; ++i) {
    const double c0 = count(fixed[i]), c1 = count(fixed[i + 1]);
    for (int k = 1; k < share[i]; ++k) nodes.push_back(inverse(c0 + (c1 - c0) * k / share[i]));
    nodes.push_back(fixed[i + 1]);
  }
  return nodes;
}

}  // namespace mantle::model
