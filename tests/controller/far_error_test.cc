#include "controller/far_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/controller/control_scene.h"

namespace mantle::controller {
namespace {

using tests::ControlScene;

struct Errors {
  explicit Errors(const std::string& scene)
      : world(scene),
        cost(world.model, *world.scene.control, world.reference),
        far(cost, world.model),
        residual(VectorX::Zero(cost.rows())),
        far_m((scene == "reach.toml" ? 0.1 : 0.02) * world.model.body_length_m) {}
  /// Value where the first rows (position or tip) are off by `by` metres along x.
  double At(double by) {
    residual(0) = by;
    return far.Value(residual);
  }
  double weight() const { return cost.weights()(0); }

  ControlScene world;
  StageCost cost;
  FarError far;
  VectorX residual;
  double far_m;  ///< a tenth of the body's length for a tip, a fiftieth for the root
};

class FarErrorOf : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(
    Scenes, FarErrorOf, testing::Values("steer.toml", "reach.toml"), [](const auto& info) {
      return std::string(info.param).substr(0, std::string(info.param).find('.'));
    });

TEST_P(FarErrorOf, IsTheSquareNearByAndALineFarAway) {
  Errors e(GetParam());
  const double length = e.world.model.body_length_m, far = e.far_m;
  const double near = 0.1 * far;
  // rho = |e|^2 (1 - |e|^2 / (4 far^2) + ...): 0.25 % less at a tenth of far
  EXPECT_NEAR(e.At(near), e.weight() * near * near, 0.003 * e.weight() * near * near);
  EXPECT_LT(e.At(near), e.weight() * near * near);
  EXPECT_NEAR(e.At(100 * length) - e.At(99 * length), e.weight() * 2 * far * length,
              1e-4 * e.weight() * 2 * far * length);
}

TEST_P(FarErrorOf, ItsWeightsGiveTheSlopeAndBoundItFromAbove) {
  Errors e(GetParam());
  VectorX weights;
  for (const double share : {0.1, 1.0, 3.0, 30.0}) {
    const double at = share * e.far_m, step = 1e-5 * at;
    const double slope = (e.At(at + step) - e.At(at - step)) / (2 * step), value = e.At(at);
    e.far.Weigh(e.residual, &weights);
    EXPECT_NEAR(2 * weights(0) * at, slope, 1e-6 * slope) << share;
    // value + weight (x^2 - at^2) lies above everywhere and touches at `at`
    for (const double other : {0.0, 0.5 * at, 0.9 * at, 1.1 * at, 4 * at}) {
      EXPECT_GE(value + weights(0) * (other * other - at * at), e.At(other) * (1 - 1e-12)) << share;
    }
    e.At(at);
  }
}

TEST(FarError, LeavesTheOtherRowsAlone) {
  Errors e("steer.toml");
  VectorX weights;
  e.residual.setConstant(10.0);
  e.far.Weigh(e.residual, &weights);
  for (const StageCost::Term& term : e.cost.terms()) {
    for (int i = term.first; i < term.first + term.count; ++i) {
      if (term.name == "position") {
        EXPECT_LT(weights(i), 0.1 * e.cost.weights()(i));
      } else {
        EXPECT_EQ(weights(i), e.cost.weights()(i)) << term.name;
      }
    }
  }
}

TEST(FarError, MeanVelocityIsTreatedAlike) {
  Errors e("swim.toml");
  const double far = 2.5 * e.far_m / e.world.scene.control->gait.period_s;  // a twentieth
  EXPECT_NEAR(e.far.MeanVelocity(1e-4 * far * far), 1e-4 * far * far, 1e-8 * far * far);
  EXPECT_NEAR(e.far.MeanVelocity(1e4 * far * far), 2 * far * 100 * far, 0.02 * 200 * far * far);
  EXPECT_NEAR(e.far.MeanVelocityFactor(far * far), std::sqrt(0.5), 1e-12);
}

}  // namespace
}  // namespace mantle::controller
