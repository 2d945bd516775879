#include "loop/plant_side/reel.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace mantle::loop {
namespace {

/// e_j with what the drum adds left out, and its rate.
struct Stretch {
  double length_m, rate_m_s;
};
Stretch PlantStretch(const ReeledCable& cable, const model::PlantWork& work) {
  return {work.cable_length_m[cable.index] - cable.rest_length_m, work.cable_rate_m_s[cable.index]};
}

}  // namespace

Reel MakeReel(const model::Plant& plant, const reduced::Actuator& motor,
              const DriveOptions& options, const model::PlantWork& work) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(fmt::format("motor \"{}\": {}", motor.name, what));
  };
  if (motor.targets.empty()) refuse("drives no cable");
  Reel reel;
  reel.gain_square = 0;
  for (const reduced::ActuatorTarget& target : motor.targets) {
    if (target.kind != reduced::ActuatorTarget::Kind::kCable) {
      refuse("drives a load that is no cable; a motor of a closed loop drives cables only");
    }
    if (target.index < 0 || target.index >= plant.cable_count()) {
      refuse(fmt::format("cable {} does not exist; the robot has {}", target.index,
                         plant.cable_count()));
    }
    if (!(target.gain > 0.0)) {
      refuse(fmt::format("gain of cable {} is {}, must be above 0", target.index, target.gain));
    }
    reel.gain_square += target.gain * target.gain;
  }
  for (const reduced::ActuatorTarget& target : motor.targets) {
    const double length = work.cable_length_m[target.index];
    reel.cables.push_back({target.index, target.gain, length,
                           options.cable_stiffness_n_m / reel.gain_square,
                           options.cable_damping_n_s_m / reel.gain_square});
  }
  reel.rest_length_m = ReelLength(reel, work.cable_length_m);
  return reel;
}

ReelState ReelAt(const Reel& reel, double t_s) {
  const double h = reel.end_s - reel.begin_s;
  if (t_s >= reel.end_s || h <= 0.0) return reel.end;
  if (t_s <= reel.begin_s) return reel.begin;
  // Cubic Hermite polynomial in s.
  const double s = (t_s - reel.begin_s) / h;
  const double rise = reel.end.reeled_m - reel.begin.reeled_m;
  const double v0 = h * reel.begin.rate_m_s;
  const double v1 = h * reel.end.rate_m_s;
  const double c2 = 3.0 * rise - 2.0 * v0 - v1;
  const double c3 = v0 + v1 - 2.0 * rise;
  return {reel.begin.reeled_m + s * (v0 + s * (c2 + s * c3)),
          (v0 + s * (2.0 * c2 + 3.0 * s * c3)) / h};
}

void SetCables(const Reel& reel, double t_s, model::PlantInputs* inputs) {
  const ReelState now = ReelAt(reel, t_s);
  for (const ReeledCable& cable : reel.cables) {
    model::CableInput& in = inputs->cables[cable.index];
    in.reeled = true;
    in.reel_m = cable.rest_length_m - cable.gain * now.reeled_m;
    in.reel_rate_m_s = -cable.gain * now.rate_m_s;
    in.stiffness_n_m = cable.stiffness_n_m;
    in.damping_n_s_m = cable.damping_n_s_m;
  }
}

double ReelLength(const Reel& reel, const std::vector<double>& cable_lengths_m) {
  double sum = 0;
  for (const ReeledCable& cable : reel.cables) sum += cable.gain * cable_lengths_m[cable.index];
  return sum / reel.gain_square;
}

double DrumTension(const Reel& reel, const std::vector<double>& cable_tensions_n) {
  double sum = 0;
  for (const ReeledCable& cable : reel.cables) sum += cable.gain * cable_tensions_n[cable.index];
  return sum;
}

double StoredEnergy(const Reel& reel, const model::PlantWork& work) {
  double sum = 0;
  for (const ReeledCable& cable : reel.cables) {
    const double e =
        std::max(0.0, PlantStretch(cable, work).length_m + cable.gain * reel.end.reeled_m);
    sum += 0.5 * cable.stiffness_n_m * e * e;
  }
  return sum;
}

firmware_sim::CableLoad LoadOnDrum(const Reel& reel, const model::PlantWork& work, double slack_m) {
  // T is piecewise linear in r: the piece of the cables that pull now, or, where none does, of the
  // one that will first.
  const auto add = [&](const ReeledCable& cable, firmware_sim::CableLoad* load) {
    const Stretch plant = PlantStretch(cable, work);
    const double e = plant.length_m + cable.gain * reel.end.reeled_m;
    load->tension_n +=
        cable.gain * (cable.stiffness_n_m * e + cable.damping_n_s_m * plant.rate_m_s);
    load->tension_rate_n_s += cable.gain * cable.stiffness_n_m * plant.rate_m_s;
    load->stiffness_n_m += cable.gain * cable.gain * cable.stiffness_n_m;
    load->damping_n_s_m += cable.gain * cable.gain * cable.damping_n_s_m;
  };
  firmware_sim::CableLoad load{.at_reeled_m = slack_m + reel.end.reeled_m};
  const ReeledCable* first = nullptr;
  double shortest_m = std::numeric_limits<double>::infinity();
  for (const ReeledCable& cable : reel.cables) {
    const Stretch plant = PlantStretch(cable, work);
    const double e = plant.length_m + cable.gain * reel.end.reeled_m;
    const double e_dot = plant.rate_m_s + cable.gain * reel.end.rate_m_s;
    if (cable.stiffness_n_m * e + cable.damping_n_s_m * e_dot > 0.0) add(cable, &load);
    if (-e / cable.gain < shortest_m) {
      shortest_m = -e / cable.gain;
      first = &cable;
    }
  }
  if (load.stiffness_n_m == 0.0 && first != nullptr) add(*first, &load);
  return load;
}

}  // namespace mantle::loop
