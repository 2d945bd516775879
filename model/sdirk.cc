#include "model/sdirk.h"

#include <Eigen/LU>
#include <cmath>

namespace mantle::model {
namespace {

std::array<double, 4> ErrorWeights(const Sdirk& t) {
  const int p = t.stages;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(p, p);
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j <= i; ++j) a(i, j) = t.a[i][j];
  }
  Eigen::MatrixXd conditions = Eigen::MatrixXd::Zero(p + 1, p + 1);
  conditions(0, 0) = 1.0;
  Eigen::VectorXd power = Eigen::VectorXd::Ones(p);
  for (int k = 0; k <= p; ++k) {
    conditions.row(k).tail(p) = power;
    power = a * power;
  }
  const Eigen::VectorXd w =
      conditions.partialPivLu().solve(t.error_constant * Eigen::VectorXd::Unit(p + 1, p));
  std::array<double, 4> out{};
  for (int k = 0; k <= p; ++k) out[k] = w(k);
  return out;
}

}  // namespace

Sdirk SdirkOf(Integrator kind) {
  Sdirk t{};
  if (kind == Integrator::kBackwardEuler) {
    t.stages = 1;
    t.gamma = 1.0;
    t.error_constant = 0.5;
    t.c = {1, 0, 0};
    t.a[0] = {1, 0, 0};
  } else if (kind == Integrator::kSdirk2) {
    const double g = 1.0 - 1.0 / std::sqrt(2.0);
    t.stages = 2;
    t.gamma = g;
    t.error_constant = std::abs(1.0 / 6.0 - g + g * g);
    t.c = {g, 1, 0};
    t.a[0] = {g, 0, 0};
    t.a[1] = {1.0 - g, g, 0};
  } else {  // root of g^3 - 3 g^2 + 3/2 g - 1/6
    const double g = 0.43586652150845899942;
    t.stages = 3;
    t.gamma = g;
    t.error_constant = std::abs(1.0 / 24.0 - 0.5 * g + 1.5 * g * g - g * g * g);
    t.c = {g, 0.5 * (1.0 + g), 1};
    t.a[0] = {g, 0, 0};
    t.a[1] = {0.5 * (1.0 - g), g, 0};
    t.a[2] = {-1.5 * g * g + 4.0 * g - 0.25, 1.5 * g * g - 5.0 * g + 1.25, g};
  }
  t.error = ErrorWeights(t);
  return t;
}

}  // namespace mantle::model
