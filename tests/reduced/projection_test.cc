#include "reduced/build/projection.h"

#include <gtest/gtest.h>

#include "tests/reduced/reduced_robots.h"

namespace mantle::reduced {
namespace {

constexpr double kRoundTrip = 1e-10;  // Gauss-Newton to 1e-13, twists up to 30 rad/s

TEST(Projection, StatesInTheReducedSpaceComeBack) {
  for (BasisKind kind : {BasisKind::kConstant, BasisKind::kLegendre}) {
    Reduction r;
    r.arms[0].basis = kind;
    r.arms[0].segments = 3;  // 20 elements: two of them straddle a segment's end
    r.arms[0].degree = 3;
    const ReducedPlant model(tests::ControlRobot(20, 32), r);
    Projection projection(model);
    model::PlantState lifted = InitialState(model.plant);
    for (unsigned seed : {1u, 2u, 3u}) {
      const ReducedState s = tests::RandomReducedState(model, 1.5, seed);
      projection.Lift(s, &lifted);
      ReducedState back = InitialState(model);
      ASSERT_TRUE(projection.Project(lifted, &back));
      EXPECT_LT((back.q - s.q).cwiseAbs().maxCoeff(), kRoundTrip * (1 + s.q.cwiseAbs().maxCoeff()));
      EXPECT_LT((back.v - s.v).cwiseAbs().maxCoeff(), kRoundTrip * (1 + s.v.cwiseAbs().maxCoeff()));
      EXPECT_LT(model::LogSE3(model::Inverse(s.root) * back.root).norm(), kRoundTrip);
    }
  }
}

TEST(Projection, StateOfAnotherPlantIsRefused) {
  const ReducedPlant model(tests::ControlRobot(20, 32), {});
  Projection projection(model);
  ReducedState back;
  EXPECT_TRUE(projection.Project(InitialState(model.plant), &back)) << "and sizes what it fills";
  EXPECT_EQ(SizeComplaint(model, back), "");
  EXPECT_FALSE(projection.Project(InitialState(model::Plant(tests::ControlRobot(21, 32))), &back));
  EXPECT_FALSE(projection.Project(InitialState(model::Plant(tests::ControlRobot(20, 33))), &back));
}

TEST(Projection, LiftedNodesLieOnTheStrainField) {
  Reduction r;
  r.arms[0].segments = 1;
  r.arms[0].strains = kSixStrains;
  const ReducedPlant model(tests::ControlRobot(10, 24), r);
  ReducedState s = InitialState(model);
  s.q.head<6>() << 1.0, 2.0, -3.0, 0.05, 0.01, -0.02;
  Projection projection(model);
  model::PlantState lifted = InitialState(model.plant);
  projection.Lift(s, &lifted);
  const model::Vector6 xi = s.q.head<6>() + model::Vector6::Unit(3);
  const model::Pose tip = s.root * model.arms[0].mount * model::ExpSE3(0.42 * xi);
  const model::Pose& at = lifted.pose[model.plant.ArmPose(0, 10)];
  EXPECT_LT((tip.position - at.position).norm(), 1e-14);  // round-off of ten exponentials
  EXPECT_LT(tip.rotation.angularDistance(at.rotation), 1e-7);
}

}  // namespace
}  // namespace mantle::reduced
