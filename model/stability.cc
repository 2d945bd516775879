#include "model/stability.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/modes.h"
#include "model/motion_modes.h"
#include "model/static_newton.h"

namespace mantle::model {
namespace {

constexpr int kMotions = 8;           // nearest to zero, where growing ones are looked for
constexpr double kNudge = 1e-2;       // rad or body lengths along the growing mode
constexpr double kLongestMove = 0.3;  // the same units, of one step downhill
constexpr int kDescents = 400;
// Of the growth rate. Growth below this share of it counts as neutral, as a turn about an axis of
// symmetry is; Newton loses the square of it, 1e-6 of a correction.
constexpr double kNeutralShift = 1e-3;

bool HasMoment(const Vector6& wrench) { return !wrench.head<3>().isZero(0.0); }

// A dead moment has no potential either: rotations do not commute.
const char* WithoutPotential(const Vector6& wrench, LoadFrame frame) {
  if (wrench.isZero(0.0)) return nullptr;
  if (frame == LoadFrame::kBody) return "follows the body";
  return HasMoment(wrench) ? "is a moment about axes fixed in space" : nullptr;
}

}  // namespace

const char* ToString(StabilityTest test) {
  return test == StabilityTest::kInertia ? "inertia" : "linearised motion";
}

std::vector<std::string> LoadsWithoutPotential(const Plant& plant, const PlantInputs& inputs) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name, const char* why) {
    if (why != nullptr) names.push_back(name + " " + why);
  };
  std::size_t distributed = 0, point = 0;
  for (const Rod& rod : plant.rods) {
    for (const auto& d : rod.distributed) {
      const Vector6 wrench = inputs.distributed[distributed++] * d.load.direction;
      add(rod.name + "." + d.name, WithoutPotential(wrench, d.load.frame));
    }
    for (const auto& p : rod.points) {
      const Vector6 wrench = inputs.points[point++] * p.load.wrench;
      add(rod.name + "." + p.load.name, WithoutPotential(wrench, p.load.frame));
    }
  }
  if (plant.shell && inputs.normal_pressure_pa != 0.0) {
    const Shell& s = *plant.shell;
    for (const int j : {0, s.node_count() - 1}) {
      if (s.nodes[j].held(0) == 0.0 && s.reference[j](0) > 0.0) {
        add("effects.normal_pressure", "follows a wall whose edge is free");
        break;
      }
    }
  }
  const Effects& effects = plant.robot.effects;
  effects.named.ForEach([&](const auto& effect) {
    using Effect = EffectType<decltype(effect)>;
    if (effect) add(fmt::format("effects.{}", Effect::kName), Effect::kWithoutPotential);
  });
  const bool current = effects.unsteady_current.has_value() ||
                       (effects.current_m_s && !effects.current_m_s->isZero(0.0));
  if (FeelsCurrent(effects) && current) {
    add("effects.current", "turns with the body's attitude");
  }
  return names;
}

Stability JudgeStability(const StaticProblem& problem, bool conservative, StaticNewton* newton) {
  Stability out;
  const int negative = newton->NegativeEigenvalues();  // also puts work() at the state
  if (conservative) {
    out.unstable_directions = negative;
    return out;
  }
  out.test = StabilityTest::kLinearisedMotion;
  try {
    PlantWork work(problem.plant());
    PlantInputs inputs;
    problem.Evaluate(newton->load_factor, &newton->state, &inputs, &work);
    for (const MotionMode& mode :
         MotionModes(problem.plant(), newton->state, inputs, kMotions, MotionAccuracy::kSign)) {
      if (!mode.unstable()) continue;
      const bool flutter = mode.rate_1_s.imag() != 0.0;
      out.unstable_directions += flutter ? 2 : 1;
      if (mode.rate_1_s.real() > out.growth_rate_1_s) {
        out.growth_rate_1_s = mode.rate_1_s.real();
        out.frequency_hz = mode.frequency_hz();
      }
    }
  } catch (const std::runtime_error&) {
    out.unstable_directions = -1;
  }
  return out;
}

bool LeaveUnstableBranch(const StaticProblem& problem, StaticNewton* newton) {
  const Plant& plant = problem.plant();
  const StaticState before = newton->state;
  const double load = newton->load_factor;
  StaticState state = before, next = before;
  PlantInputs inputs;
  PlantWork work(plant);
  if (problem.Evaluate(load, &state, &inputs, &work)) return false;
  std::vector<Mode> modes;
  try {
    modes = VibrationModes(plant, state, inputs, 1);
  } catch (const std::runtime_error&) {
    return false;
  }
  if (!(modes[0].growth_rate_1_s > 0.0)) return false;
  const double size = problem.Size(modes[0].shape);
  problem.Move(before, problem.StepOf(work, modes[0].shape), kNudge / size, &state);
  StaticStep step;
  NewtonMatrix matrix(plant);
  double s = 2.0 * modes[0].growth_rate_1_s;
  const double shift = newton->shift_1_s;
  newton->shift_1_s = kNeutralShift * modes[0].growth_rate_1_s;
  const auto back = [&] {
    newton->state = before;
    newton->load_factor = load;
    newton->shift_1_s = shift;
    return false;
  };
  for (int k = 0; k < kDescents; ++k) {
    if (problem.Evaluate(load, &state, &inputs, &work)) return back();
    const bool valley = matrix.FactorAtRest(plant, state, inputs, work, newton->shift_1_s) &&
                        matrix.NegativeEigenvalues() == 0;
    if (valley) {
      newton->state = state;
      if (newton->AtLoad(load) == StaticNewton::Outcome::kConverged &&
          newton->NegativeEigenvalues() == 0) {
        return true;
      }
    }
    while (true) {  // a step downhill, shorter where it is too long
      if (s > 1e12) return back();
      if (matrix.FactorAtRest(plant, state, inputs, work, s) && matrix.NegativeEigenvalues() == 0) {
        problem.Solve(work.force, &matrix, &step);
        problem.Move(state, step, 1.0, &next);
        if (problem.Size(step.zeta) < kLongestMove &&
            !problem.Evaluate(load, &next, &inputs, &work))
          break;
        if (problem.Evaluate(load, &state, &inputs, &work)) return back();
      }
      s *= 2.0;
    }
    state = next;
    s *= 0.8;
  }
  return back();
}

}  // namespace mantle::model
