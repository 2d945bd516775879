#include "model/sdirk.h"

#include <gtest/gtest.h>

#include <cmath>

// The methods and their error constants, on y' = lambda y.

namespace mantle::model {
namespace {

constexpr Integrator kMethods[] = {Integrator::kBackwardEuler, Integrator::kSdirk2,
                                   Integrator::kSdirk3};

struct LinearStep {
  double end, estimate;
};

// One step of y' = z y, y(0) = 1, h = 1: its end and the estimated local error.
LinearStep StepOf(const Sdirk& t, double z) {
  double rate[3];
  LinearStep out{1, t.error[0] * z};
  for (int i = 0; i < t.stages; ++i) {
    double y = 1.0;
    for (int j = 0; j < i; ++j) y += t.a[i][j] * rate[j];
    rate[i] = z * y / (1.0 - t.gamma * z);
    out.estimate += t.error[i + 1] * rate[i];
    if (i + 1 == t.stages) out.end = rate[i] / z;  // stiffly accurate
  }
  return out;
}

TEST(Sdirk, ErrsByItsErrorConstant) {
  for (Integrator kind : kMethods) {
    const Sdirk t = SdirkOf(kind);
    EXPECT_EQ(t.stages, OrderOf(kind));
    for (double z : {-0.02, 0.02}) {
      const double error = std::abs(StepOf(t, z).end - std::exp(z));
      const double power = std::pow(std::abs(z), t.stages + 1);
      EXPECT_NEAR(error / power, t.error_constant, 0.1 * t.error_constant) << t.stages;
      // The estimate is of the rate: of z y here.
      EXPECT_NEAR(std::abs(StepOf(t, z).estimate) / power, t.error_constant, 0.1 * t.error_constant)
          << t.stages;
    }
  }
}

TEST(Sdirk, DampsWhatIsInfinitelyStiff) {
  for (Integrator kind : kMethods) {
    EXPECT_LT(std::abs(StepOf(SdirkOf(kind), -1e9).end), 1e-7);
  }
}

}  // namespace
}  // namespace mantle::model
