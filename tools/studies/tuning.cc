#include "tools/studies/tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace mantle::tools {
namespace {

using controller::BaselineGains;
using controller::ControllerKind;

constexpr double kFirstStep = 0.15;  // of a parameter's range
constexpr double kFailed = 1e6;      // costs of runs that end are at most some thousands
constexpr int kStarts = 2;

std::size_t Index(ControllerKind kind) { return static_cast<std::size_t>(kind) - 1; }

double ToUnit(const TunedParameter& p, double value) {
  const double v = std::clamp(value, p.low, p.high);
  if (p.logarithmic) return std::log(v / p.low) / std::log(p.high / p.low);
  return (v - p.low) / (p.high - p.low);
}

// With four figures, as it will stand in the scene.
double FromUnit(const TunedParameter& p, double unit) {
  const double value =
      p.logarithmic ? p.low * std::pow(p.high / p.low, unit) : p.low + unit * (p.high - p.low);
  if (value == 0) return 0;
  const double digit = std::pow(10.0, 3 - std::floor(std::log10(std::abs(value))));
  return std::round(value * digit) / digit;
}

const TunedParameter kEvery[] = {
    {"gait_scale", &BaselineGains::gait_scale},
    {"gait_period", &BaselineGains::gait_period},
    {"gait_lead", &BaselineGains::gait_lead_s},
    {"proportional", &BaselineGains::proportional},
    {"integral", &BaselineGains::integral},
    {"derivative", &BaselineGains::derivative},
    {"lookahead", &BaselineGains::lookahead_s},
    {"effort", &BaselineGains::lqr_effort},
    {"speed_gain", &BaselineGains::speed_gain},
};

}  // namespace

std::vector<TunedParameter> TunedParameters(ControllerKind kind,
                                            const controller::ControlGoal& goal) {
  const bool circle = std::holds_alternative<controller::CircleTask>(goal);
  const bool cruise = std::holds_alternative<controller::CruiseTask>(goal);
  const bool path = std::holds_alternative<controller::PathTask>(goal);
  const bool feeds_back = kind == ControllerKind::kPursuit || kind == ControllerKind::kPid;
  std::vector<TunedParameter> out;
  out.push_back({"gait_scale", &BaselineGains::gait_scale, 0.0, circle ? 4.0 : 2.5});
  if (circle) out.push_back({"gait_lead", &BaselineGains::gait_lead_s, 0.0, 2.0});
  if (!circle && !(path && feeds_back)) {
    out.push_back({"gait_period", &BaselineGains::gait_period, 0.6, 2.0});
  }
  if (!circle && kind != ControllerKind::kGait) {
    out.push_back({"speed_gain", &BaselineGains::speed_gain, 0.0, path ? 100.0 : 60.0});
  }
  if (feeds_back) {
    out.push_back({"proportional", &BaselineGains::proportional, 0.0, circle ? 100.0 : 6.0});
    out.push_back({"derivative", &BaselineGains::derivative, 0.0, circle ? 8.0 : 4.0});
  }
  if (kind == ControllerKind::kPid) {
    out.push_back({"integral", &BaselineGains::integral, 0.0, circle ? 80.0 : 3.0});
  }
  if (kind == ControllerKind::kLqr) {
    out.push_back({"effort", &BaselineGains::lqr_effort, 1e-2, 1e2, true});
  }
  if (!cruise && kind != ControllerKind::kGait) {
    out.push_back({"lookahead", &BaselineGains::lookahead_s, 0.0, circle ? 1.0 : 5.0});
  }
  return out;
}

BaselineGains SoundStart(const controller::ControlGoal& goal) {
  BaselineGains g;
  if (std::holds_alternative<controller::CircleTask>(goal)) {
    g.proportional = 5;
    g.integral = 10;
    g.derivative = 0.5;
    g.lookahead_s = 0.2;
  } else {
    g.proportional = 2;
    g.integral = 0.1;
    g.derivative = 0.5;
    g.lookahead_s = 1.5;
    g.speed_gain = 10;
  }
  return g;
}

double FailedCost(double share_of_duration) { return kFailed * (2.0 - share_of_duration); }

loop::LoopResult RunBaseline(const scene::Scene& scene, ControllerKind kind,
                             const BaselineGains& gains, const std::function<bool()>& stop) {
  scene::Scene trial = scene;
  if (trial.control) trial.control->baselines[Index(kind)] = gains;
  loop::ClosedLoopOptions options;
  options.controller = ToString(kind);
  options.bus = "loop";
  loop::ClosedLoop loop(trial, options);
  return loop.Run([&](const loop::LoopStep&) { return !stop(); });
}

Tuning Tune(const scene::Scene& scene, ControllerKind kind, const TuningSettings& settings,
            const std::function<bool(int, double)>& progress) {
  if (!scene.control) {
    throw scene::BadScene(scene.name + ": control: table is missing: there is no loop to tune");
  }
  const auto parameters = TunedParameters(kind, scene.control->goal);
  Tuning out;
  out.kind = kind;
  bool stopped = false;
  int count = 0;
  const auto stop = [&] {
    stopped = stopped || !progress(count, out.cost);
    return stopped;
  };
  const auto cost = [&](const BaselineGains& gains) {
    const loop::LoopResult r = RunBaseline(scene, kind, gains, stop);
    const bool ok = r.ok && std::isfinite(r.cost) && r.cost < kFailed;
    const double value = ok ? r.cost : FailedCost(std::min(1.0, r.time_s / scene.run.duration_s));
    ++count;
    if ((count == 1 || value < out.cost) && !stopped) {
      out.gains = gains;
      out.cost = value;
      out.ok = ok;
    }
    return value;
  };
  const BaselineGains given = scene.control->baselines[Index(kind)];
  out.cost_before = cost(given);
  BaselineGains start = given, sound = given;
  const BaselineGains usual = SoundStart(scene.control->goal);
  for (const TunedParameter& p : parameters) sound.*p.value = usual.*p.value;
  if (cost(sound) < out.cost_before) start = sound;
  std::vector<double> unit;
  for (const TunedParameter& p : parameters) unit.push_back(ToUnit(p, start.*p.value));
  Minimise(
      settings.method, unit, kFirstStep, settings.evaluations - kStarts,
      [&](const std::vector<double>& x) {
        BaselineGains gains = start;
        for (std::size_t i = 0; i < x.size(); ++i) {
          gains.*parameters[i].value = FromUnit(parameters[i], x[i]);
        }
        return cost(gains);
      },
      stop);
  out.evaluations = count;
  return out;
}

std::string TuningToml(const Tuning& tuning, const scene::Scene& scene) {
  const auto tuned = TunedParameters(tuning.kind, scene.control->goal);
  std::string text =
      fmt::format("[control.baselines.{}]  # cost {:.4g} after {} evaluations\n",
                  kBaselineNames[Index(tuning.kind)], tuning.cost, tuning.evaluations);
  for (const TunedParameter& p : kEvery) {
    const bool searched =
        std::any_of(tuned.begin(), tuned.end(), [&](const auto& t) { return t.key == p.key; });
    if (!searched && tuning.gains.*p.value == BaselineGains{}.*p.value) continue;
    text += fmt::format("{} = {:.4g}\n", p.key, tuning.gains.*p.value);
  }
  return text;
}

}  // namespace mantle::tools
