#include "reduced/mantle.h"

#include <gtest/gtest.h>

#include "model/plant.h"
#include "reduced/build/mantle.h"
#include "reduced/build/mantle_basis.h"
#include "tests/reduced/reduced_robots.h"

namespace mantle::reduced {
namespace {

model::Robot Robot() { return tests::ControlRobot(8, 48); }

TEST(MantleShapes, AreOrthonormalInThePlantsMass) {
  const model::Plant plant(Robot());
  MantleReduction r;
  r.modes = 2;
  const MantleShapes shapes = MakeMantleShapes(plant, r);
  ASSERT_EQ(shapes.shapes.cols(), 4);
  model::VectorX mass(3 * plant.shape_count());
  for (int j = 0; j < plant.shape_count(); ++j) {
    mass.segment<3>(3 * j) = plant.shell->nodes[j].inertia;
  }
  const Eigen::MatrixXd gram = shapes.shapes.transpose() * mass.asDiagonal() * shapes.shapes;
  EXPECT_LT((gram - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff(), 1e-12);  // round-off
}

TEST(MantleShapes, FirstModeIsThePlantsInWater) {
  model::Robot robot = Robot();
  robot.mantle = tests::PaperMantle(64, 4);
  robot.mantle->strips = {tests::PaperStrip(model::ConstantSchedule{0.0})};
  const MantleShapes shapes = MakeMantleShapes(model::Plant(robot), {});
  // 2.848 Hz by convergence; a graded mesh of 64 is within 0.5 % ([physics.md] 3 and 7)
  EXPECT_NEAR(shapes.mode_frequencies_rad_s[0] / (2 * std::numbers::pi), 2.848, 5e-3 * 2.848);
}

TEST(MantleShapes, FewElementsCarryTheForces) {
  const model::Plant plant(Robot());
  const ReducedMantle m = MakeReducedMantle(plant, {});
  EXPECT_LE(m.cubature_residual, 1e-3);
  EXPECT_LE(m.elements.size(), 20u);
  EXPECT_GE(m.elements.size(), 4u);
}

void Refused(const model::Robot& robot, const MantleReduction& r, const char* word) {
  try {
    MakeReducedMantle(model::Plant(robot), r);
    ADD_FAILURE() << "accepted: " << word;
  } catch (const model::BadRobot& error) {
    EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

TEST(MantleShapes, RefuseWhatCannotBe) {
  MantleReduction r;
  r.modes = 9;
  Refused(Robot(), r, "must be in [1, 8]");
  r = {};
  r.static_pressures_pa = std::vector<double>{600.0};
  Refused(Robot(), r, "static_pressures = 600 Pa: no stable equilibrium");
  r.static_pressures_pa = std::vector<double>{160.0, 160.0};
  Refused(Robot(), r, "depends on the others");
  model::Robot bare = Robot();
  bare.mantle->strips.clear();
  r.static_pressures_pa = std::vector<double>{160.0};
  Refused(bare, r, "no strip");
  model::Robot coarse = Robot();
  coarse.mantle->pieces = {{0.05, 0.0}};
  coarse.mantle->theta0_rad = -std::numbers::pi / 2;
  coarse.mantle->r0_m = 0.03;
  coarse.mantle->strips.clear();
  coarse.mantle->stations_m.clear();
  coarse.mantle->elements = 2;
  r.static_pressures_pa = std::vector<double>{};
  r.modes = 7;
  Refused(coarse, r, "the mesh of 3 nodes has 6");
}

}  // namespace
}  // namespace mantle::reduced
