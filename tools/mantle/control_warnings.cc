#include "tools/mantle/control_warnings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/gait.h"
#include "controller/reference.h"
#include "controller/steering.h"
#include "controller/trajectory.h"
#include "reduced/outputs.h"

namespace mantle::tools {
namespace {

using controller::CircleTask;
using controller::ControlOptions;
using controller::PathTask;
using model::Vector3;

constexpr double kTurnTime_s = 8.0, kTurnStep_s = 0.02, kTolerance = 1e-6;
constexpr double kFarLength = 0.02;  // of the body: a start further off than that is said
constexpr double kCusp_rad = 0.5;    // between neighbours of 200 samples a span
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Weight {
  const char* name;
  double value;
  bool counts;  ///< the goal looks at it
};

std::vector<Weight> Weights(const scene::Scene& scene) {
  const controller::CostWeights& c = scene.control->cost;
  const bool path = std::holds_alternative<PathTask>(scene.control->goal);
  const bool tip = std::holds_alternative<CircleTask>(scene.control->goal);
  return {{"position", c.position, path},
          {"heading", c.heading, !tip},
          {"velocity", c.velocity, !tip},
          {"mean_velocity", c.mean_velocity, !tip},
          {"turn_rate", c.turn_rate, true},
          {"tip", c.tip, tip},
          {"volume", c.volume, scene.robot.mantle.has_value()}};
}

void WarnOfWeights(const scene::Scene& scene, std::vector<std::string>* out) {
  std::vector<std::string> ignored;
  bool any = !scene.control->bounds.empty(), given = false;
  for (const Weight& w : Weights(scene)) {
    given = given || w.value > 0;
    if (w.value > 0 && w.counts) any = true;
    if (w.value > 0 && !w.counts) ignored.push_back(fmt::format("{} = {:.6g}", w.name, w.value));
  }
  if (!any) {
    out->push_back(
        fmt::format("control.cost: every weight of the state{} is zero: the best that a controller "
                    "can do is nothing",
                    given ? " that the goal looks at" : ""));
  }
  if (!ignored.empty()) {
    out->push_back(
        fmt::format("control.cost: the goal does not look at {}", fmt::join(ignored, ", ")));
  }
}

void WarnOfPath(const scene::Scene& scene, const reduced::ReducedModel& model,
                const controller::Reference& reference, std::vector<std::string>* out) {
  if (!reference.has_position()) return;
  const controller::Reference::Bend bend = reference.Tightest();
  const auto at = [&] {
    return fmt::format("at ({:.3f}, {:.3f}, {:.3f}) m, {:.2f} s", bend.position.x(),
                       bend.position.y(), bend.position.z(), bend.time_s);
  };
  if (bend.angle_rad > kCusp_rad) {
    out->push_back(
        fmt::format("control.goal.waypoints: the path has a cusp {}: it turns by {:.0f} degrees "
                    "within {:.2g} m; give it room between the waypoints",
                    at(), 180.0 / M_PI * bend.angle_rad, bend.length_m));
    return;
  }
  const double turns_m = TightestTurn(scene, model);
  if (bend.radius_m >= turns_m || !std::isfinite(turns_m)) return;
  out->push_back(fmt::format(
      "control.goal.waypoints: the path bends to a radius of {:.3g} m {}, tighter than the vehicle "
      "turns: {:.3g} m with a steering motor at its limit",
      bend.radius_m, at(), turns_m));
}

void WarnOfStart(const reduced::ReducedModel& model, const controller::Reference& reference,
                 std::vector<std::string>* out) {
  if (!reference.has_tip()) return;  // a path begins where the vehicle is
  const reduced::ReducedState start = InitialState(model);
  const int arm = reference.arm();
  const model::Pose tip =
      EvaluateTip(model.arms[arm], start.q.data() + model.arm_first(arm), nullptr);
  const Vector3 place = start.root.position + start.root.rotation * tip.position;
  const double off_m = (place - reference.At(0.0).tip).norm();
  if (off_m < kFarLength * model.body_length_m) return;
  out->push_back(fmt::format(
      "control.goal: the reference starts {:.3g} mm from the tip ({:.1f} % of body length): it is "
      "at ({:.3f}, {:.3f}, {:.3f}) m, the tip at ({:.3f}, {:.3f}, {:.3f}) m",
      1e3 * off_m, 100 * off_m / model.body_length_m, reference.At(0.0).tip.x(),
      reference.At(0.0).tip.y(), reference.At(0.0).tip.z(), place.x(), place.y(), place.z()));
}

// A circle's gait goes round with it: that is no pulse.
void WarnOfHorizon(const ControlOptions& control, std::vector<std::string>* out) {
  if (std::holds_alternative<CircleTask>(control.goal)) return;
  const bool pulses = std::any_of(control.gait.motors.begin(), control.gait.motors.end(),
                                  [](const auto& m) { return m.high_n > m.low_n; });
  const double length_s = MakeHorizon(control.grid, control.motors).length_s();
  if (!pulses || control.controller != ToString(controller::ControllerKind::kMpc) ||
      length_s >= control.gait.period_s) {
    return;
  }
  out->push_back(fmt::format(
      "control.grid: the horizon of {:.3g} s is shorter than a pulse of the gait, {:.3g} s: a plan "
      "does not see what a pulse brings",
      length_s, control.gait.period_s));
}

}  // namespace

double TightestTurn(const scene::Scene& scene, const reduced::ReducedModel& model) {
  if (!model.root_free()) return kInfinity;
  const ControlOptions& control = *scene.control;
  const Eigen::Matrix2Xd directions = controller::PullDirections(model, -1);
  controller::Propagator propagator(model, {scene.reduction.scheme, kTolerance});
  model::VectorX tensions(model.input_count());
  double tightest_m = kInfinity;
  for (Eigen::Index pulled = 0; pulled < directions.cols(); ++pulled) {
    if (directions.col(pulled).norm() == 0) continue;
    const controller::MotorLimits& limits = control.motors[static_cast<std::size_t>(pulled)];
    reduced::ReducedState state = InitialState(model), next = state;
    double way_m = 0, turn_rad = 0;
    bool ok = true;
    while (ok && state.time_s < kTurnTime_s) {
      GaitTensions(control.gait, state.time_s + 0.5 * kTurnStep_s, tensions);
      tensions(pulled) =
          std::min(limits.max_tension_n, limits.min_tension_n + limits.max_rate_n_s * state.time_s);
      ok = propagator.Step(state, kTurnStep_s, tensions, &next, nullptr).ok;
      next.time_s = state.time_s + kTurnStep_s;
      if (state.time_s >= 0.5 * kTurnTime_s) {
        const Vector3 before = state.root.rotation * Vector3::UnitZ();
        const Vector3 after = next.root.rotation * Vector3::UnitZ();
        way_m += (next.root.position - state.root.position).dot(before);
        turn_rad += std::atan2(before.cross(after).norm(), before.dot(after));
      }
      std::swap(state, next);
    }
    if (ok && way_m > 0 && turn_rad > 0) tightest_m = std::min(tightest_m, way_m / turn_rad);
  }
  return tightest_m;
}

std::vector<std::string> ControlWarnings(const scene::Scene& scene,
                                         const reduced::ReducedModel& model) {
  std::vector<std::string> out;
  const controller::Reference reference(scene.control->goal, scene.robot);
  WarnOfWeights(scene, &out);
  WarnOfPath(scene, model, reference, &out);
  WarnOfStart(model, reference, &out);
  WarnOfHorizon(*scene.control, &out);
  return out;
}

}  // namespace mantle::tools
