#include "model/run_schema.h"

#include <fmt/format.h>

#include <algorithm>

namespace mantle::model {
namespace {

using schema::kPositive;
using schema::kTimeStep;
using schema::Quantity;
using schema::Range;
using schema::Required;

constexpr Range kTolerance{0, 0.1, true};
// Time advances by every step, however late in a run: 1e12 steps leave a step four digits.
constexpr double kMostSteps = 1e12;

}  // namespace

void DescribeTime(schema::Visitor& v, RunSettings& run) {
  v.Number(Required({"duration"}), Quantity::kTime, Range{kTimeStep.low, 1e9}, &run.duration_s);
  v.Number({"step", "of fixed steps; the longest of error-controlled ones and of cvode"},
           Quantity::kTime, kTimeStep, &run.step_s);
  v.Demand(run.duration_s <= kMostSteps * run.step_s, "step",
           fmt::format("{:.3g} steps in `duration`, {} s: must be at most {:.0e}",
                       run.duration_s / run.step_s, run.duration_s, kMostSteps));
  run.min_step_s = std::min(run.min_step_s, run.step_s);
  v.Number({.name = "min_step",
            .meaning = "a failing step is halved down to this",
            .bound = "[1e-9 s, `step`]"},
           Quantity::kTime, Range{kTimeStep.low, run.step_s}, &run.min_step_s);
  StepperSettings& s = run.stepper;
  v.Choice<Integrator>(
      {"integrator", "rk4 refuses unstable steps; cvode is the accuracy reference"},
      {{"sdirk2", Integrator::kSdirk2},
       {"sdirk3", Integrator::kSdirk3},
       {"backward_euler", Integrator::kBackwardEuler},
       {"rk4", Integrator::kRk4},
       {"cvode", Integrator::kCvode}},
      &s.integrator);
  v.Number(
      {"tolerance",
       "error-controlled steps of sdirk2, sdirk3 and backward_euler: largest estimated error of "
       "one, in rad, body lengths, and per second; 0: fixed steps, as those of the reduced model "
       "always are"},
      Quantity::kNumber, Range{0, 1, false}, &s.step_tolerance);
  v.Number({"newton_tolerance",
            "implicit steps: share of the step's own estimated error that the iteration may leave"},
           Quantity::kNumber, kTolerance, &s.newton_tolerance);
  v.Integer({"newton_iterations", "most iterations of a stage"}, 1, 1000, &s.newton_max_iterations);
  v.Number({"relative_tolerance", "cvode"}, Quantity::kNumber, kTolerance, &s.relative_tolerance);
  v.Number({"absolute_tolerance", "cvode: rad, body lengths, and per second"}, Quantity::kNumber,
           kTolerance, &s.absolute_tolerance);
}

void DescribeOutput(schema::Visitor& v, RunSettings& run) {
  v.Number({"interval", "between rows of trajectory.csv"}, Quantity::kTime, kTimeStep,
           &run.output_interval_s);
  v.Boolean({"energy", "works, drift and indices"}, &run.account_energy);
}

void Describe(schema::Visitor& v, StaticsSettings& s) {
  v.Number({"time", "at which schedules are evaluated"}, Quantity::kTime, schema::kAnyValue,
           &s.time_s);
  v.Integer({"load_steps", "steps to the full load; first step of arc length"}, 1, 1000000,
            &s.load_steps);
  v.Boolean({"arc_length", "follow the path past limit points"}, &s.arc_length);
  v.Number({"max_load_factor", "stop there"}, Quantity::kNumber, kPositive, &s.max_load_factor);
  v.Integer({"max_points", "of an arc-length path; one that needs more is incomplete"}, 1, 1000000,
            &s.max_points);
  v.Boolean({"stop_at_limit", "arc length: stop once a limit point has been located"},
            &s.stop_at_limit);
  v.Number({"tolerance", "of the increments, rad and body lengths"}, Quantity::kNumber, kTolerance,
           &s.tolerance);
  v.Integer({"max_iterations", "of one load step"}, 1, 1000, &s.max_iterations);
  v.Choice<StaticBranch>({"branch",
                          "at a bifurcation: stay on the path, be it unstable, or leave it for the "
                          "stable one"},
                         {{"primary", StaticBranch::kPrimary}, {"stable", StaticBranch::kStable}},
                         &s.branch);
}

}  // namespace mantle::model
