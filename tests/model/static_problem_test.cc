#include "model/static_problem.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "model/static_newton.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

VectorX Random(int n, unsigned seed) {
  tests::RandomValues values(seed);
  VectorX x(n);
  for (double& e : x) e = values.Uniform();
  return x;
}

// An arm and a mantle under everything that acts at rest, in a current, pulled by a stiff reel.
Robot Loaded() {
  Robot robot = tests::PaperRobot(9, 16);
  robot.root = ClampedRoot{};
  robot.effects = tests::EveryEffect();
  robot.effects.current_m_s = Vector3(0.2, -0.3, 0.25);
  Arm& arm = robot.arms[0];
  ArmCable reel;
  reel.name = "reel";
  reel.end_m = arm.length_m;
  reel.drive = ReeledLength{ConstantSchedule{-0.02}, 300.0, 1.0};
  arm.cables.push_back(reel);
  Vector6 wrench;
  wrench << 1e-3, 2e-3, -1e-3, 0.02, 0.03, 0.01;
  arm.points.push_back({"dead", arm.length_m, wrench, LoadFrame::kWorld, ConstantSchedule{1}});
  arm.points.push_back({"follows", arm.length_m, wrench, LoadFrame::kBody, ConstantSchedule{1}});
  return robot;
}

std::ptrdiff_t WidestNode(const StaticState& state) {
  const auto narrower = [](const Vector3& a, const Vector3& b) { return a(0) < b(0); };
  return std::max_element(state.shape.begin(), state.shape.end(), narrower) - state.shape.begin();
}

struct At {
  At() : plant(Loaded()), problem(plant, 0.2), work(plant), matrix(plant) {
    state = problem.Reference();
    const int n = plant.velocity_size();
    VectorX bend = Random(n, 3) * 0.004;  // some tenths of strain in elements of 47 mm
    bend.head<6>().setZero();
    bend.tail(3 * plant.shape_count()) *= 0.1;
    Hold(&bend);
    problem.Evaluate(0.8, &state, &inputs, &work);
    StaticState moved = state;
    problem.Move(state, problem.StepOf(work, bend), 1.0, &moved);
    state = moved;
    EXPECT_FALSE(problem.Evaluate(0.8, &state, &inputs, &work));
  }
  void Hold(VectorX* x) const {
    x->head<6>().setZero();
    for (int j = 0; j < plant.shape_count(); ++j) {
      auto q = x->segment<3>(plant.ShellVelocity(j));
      q = q.cwiseProduct(Vector3::Ones() - plant.shell->nodes[j].held).eval();
    }
  }
  Plant plant;
  StaticProblem problem;
  StaticState state;
  PlantInputs inputs;
  PlantWork work;
  NewtonMatrix matrix;
};

TEST(StaticProblem, TangentIsCompleteUnderEveryLoadAndACurrent) {
  // A x = -df along x, by central differences of fourth order, solved back to x. What is left falls
  // sixteenfold where the difference is halved (2e-7 at 1e-4), down to round-off near 4e-10. The
  // mantle's drag goes with its largest radius and has a kink where another node becomes the
  // widest: the differences must stay on one side of it.
  constexpr double kDifference = 2e-5, kTolerance = 1e-8;
  At at;
  ASSERT_TRUE(at.matrix.FactorAtRest(at.plant, at.state, at.inputs, at.work, 0.0));
  VectorX x = Random(at.plant.velocity_size(), 11);
  at.Hold(&x);
  x.tail(3 * at.plant.shape_count()) *= 0.03;
  const StaticStep step = at.problem.StepOf(at.work, x);
  VectorX force = VectorX::Zero(x.size());
  PlantWork work(at.plant);
  PlantInputs inputs;
  StaticState moved = at.state;
  for (const auto& [h, weight] : {std::pair{1.0, 8.0}, {-1.0, -8.0}, {2.0, -1.0}, {-2.0, 1.0}}) {
    at.problem.Move(at.state, step, h * kDifference, &moved);
    ASSERT_FALSE(at.problem.Evaluate(0.8, &moved, &inputs, &work));
    ASSERT_EQ(WidestNode(moved), WidestNode(at.state));
    force -= weight / (12.0 * kDifference) * work.force;
  }
  StaticStep solved;
  at.problem.Solve(force, &at.matrix, &solved);
  EXPECT_LT((solved.zeta - x).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_LT((solved.strain - step.strain).cwiseAbs().maxCoeff(), kTolerance);
}

TEST(StaticProblem, MovesStrainsAsTheLinearisationForesees) {
  At at;
  // Small beside elements of 47 mm (arm) and 8 mm (mantle), which it must not turn inside out.
  VectorX x = 0.004 * Random(at.plant.velocity_size(), 5);
  at.Hold(&x);
  x.tail(3 * at.plant.shape_count()) *= 0.1;
  const StaticStep step = at.problem.StepOf(at.work, x);
  StaticState moved = at.state;
  at.problem.Move(at.state, step, 0.7, &moved);
  ASSERT_FALSE(at.problem.Evaluate(0.8, &moved, &at.inputs, &at.work));
  int strain = 0;
  for (int i = 0; i < at.plant.rods[0].element_count(); ++i, strain += 6) {
    const Vector6 change = moved.extension[0][i] - at.state.extension[0][i];
    EXPECT_LT((change - 0.7 * step.strain.segment<6>(strain)).norm(), 1e-15);
    const RodElement& e = at.plant.rods[0].elements[i];
    const Vector6 read = at.work.rod[0][i].d - e.length * e.reference_strain;
    EXPECT_LT((read - moved.extension[0][i]).norm(), 1e-13) << "poses and strains agree";
  }
}

TEST(StaticProblem, LoadsAreLinearInTheLoadFactorAlsoThoseOfACurrent) {
  Robot robot = Loaded();
  robot.effects.added_mass = false;
  const Plant plant(robot);
  const StaticProblem problem(plant, 0.2);
  StaticState state = problem.Reference();
  PlantInputs inputs;
  PlantWork work(plant);
  VectorX forces[3];
  for (int k = 0; k < 3; ++k) {
    ASSERT_FALSE(problem.Evaluate(0.5 * k, &state, &inputs, &work));
    forces[k] = work.force;
  }
  EXPECT_LT((forces[2] - 2.0 * forces[1] + forces[0]).cwiseAbs().maxCoeff(),
            1e-12 * forces[2].cwiseAbs().maxCoeff());
  EXPECT_GT((forces[2] - forces[0]).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(StaticProblem, RefusesAFreeRoot) {
  Robot robot = Loaded();
  robot.root = FreeRoot{};
  const Plant plant(robot);
  EXPECT_THROW(StaticProblem(plant, 0.0), BadRobot);
}

}  // namespace
}  // namespace mantle::model
