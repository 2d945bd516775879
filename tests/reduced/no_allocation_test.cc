#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "reduced/build/projection.h"
#include "reduced/step.h"
#include "tests/reduced/reduced_robots.h"

// Counts every allocation of this program: operator new and, because Eigen's fixed-alignment memory
// comes from there, malloc.
namespace {
thread_local bool counting = false;
thread_local long allocations = 0;
}  // namespace

extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  if (counting) ++allocations;
  return __libc_malloc(size);
}

namespace mantle::reduced {
namespace {

TEST(NoAllocation, StepWithJacobiansAndLifting) {
  for (BasisKind kind : {BasisKind::kConstant, BasisKind::kLegendre}) {
    Reduction r;
    r.arms[0].basis = kind;
    const ReducedPlant model(tests::ControlRobot(12, 32), r);
    const ReducedState s = tests::RandomReducedState(model, 0.3, 2);
    ReducedState end = s;
    model::PlantInputs inputs;
    EvaluateInputs(model.plant, 0.0, false, &inputs);
    inputs.cables[1].tension_n = 0.3;
    inputs.strips_pa[0] = 100;
    StepWork work(model);
    StepJacobian jacobian(model);
    Projection projection(model);
    model::PlantState lifted = InitialState(model.plant);
    const std::vector<double> u(model.input_count(), 0.1);
    for (int repeat = 0; repeat < 2; ++repeat) {
      counting = true;
      allocations = 0;
      ApplyControls(model, u.data(), &inputs);
      const StepOutcome a = TakeStep(model, {}, 0.05, s, inputs, inputs, &work, &end, nullptr);
      const StepOutcome b = TakeStep(model, {}, 0.05, s, inputs, inputs, &work, &end, &jacobian);
      projection.Lift(end, &lifted);
      counting = false;
      EXPECT_TRUE(a.ok && b.ok) << a.cause << b.cause;
      EXPECT_EQ(allocations, 0) << "repeat " << repeat;
    }
  }
}

}  // namespace
}  // namespace mantle::reduced
