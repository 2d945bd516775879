#include "reduced/build/mantle_guard.h"

#include <fmt/format.h>

#include <cmath>

#include "model/simulation.h"
#include "model/validity.h"
#include "reduced/build/mantle_basis.h"

namespace mantle::reduced {

MantleGuard::MantleGuard(const ReducedPlant& model)
    : model_(model),
      work_(model),
      still_(VectorX::Zero(model.velocity_count())),
      tensions_n_(model.plant.cable_count(), 0.0) {}

model::StepStatus MantleGuard::Judge(const ReducedState& state, const model::PlantInputs& inputs) {
  if (!model_.mantle) return {};
  if (const ReducedFailure failure = EvaluateResidual(model_, state, still_, inputs, &work_)) {
    return {false, fmt::format("t = {:.6g} s: {}", state.time_s, failure.Message())};
  }
  const ReducedMantle& mantle = *model_.mantle;
  for (int i = 0; i < mantle.size; ++i) {
    const double share = std::abs(state.q(model_.mantle_first() + i)) / mantle.basis.scale(i);
    if (share <= farthest_) continue;
    farthest_ = share;
    farthest_s_ = state.time_s;
    farthest_coordinate_ = i;
  }
  if (auto status = JudgeThrust(model_.plant, state.time_s, work_.mantle[0].thrust_n); !status.ok) {
    return status;
  }
  return JudgeCollapse(state, inputs);
}

model::StepStatus MantleGuard::JudgeCollapse(const ReducedState& state,
                                             const model::PlantInputs& inputs) {
  for (std::size_t k = 0; k < work_.mantle[0].cable_tension_n.size(); ++k) {
    tensions_n_[model_.SpokeIndex(static_cast<int>(k))] = work_.mantle[0].cable_tension_n[k];
  }
  const double pressure = InwardPressure(model_.plant, inputs, tensions_n_);
  const double volume = work_.mantle[0].volume_m3;
  const auto forget = [&] { held_since_s_ = std::numeric_limits<double>::infinity(); };
  if (pressure <= model_.mantle->basis.reach_pa) {
    forget();
    return {};
  }
  if (!collapse_pa_) {
    collapse_pa_ = CollapsePressure(model_.plant).value_or(std::numeric_limits<double>::infinity());
  }
  if (pressure <= *collapse_pa_) {
    forget();
    return {};
  }
  if (pressure > above_pa_) {
    above_pa_ = pressure;
    above_s_ = state.time_s;
  }
  if (!(held_since_s_ <= state.time_s) ||
      std::abs(volume - held_m3_) > kHeldVolume * model_.plant.shell->rest_volume_m3) {
    held_since_s_ = state.time_s;
    held_m3_ = volume;
  }
  if (state.time_s - held_since_s_ < kHeldTime_s) return {};
  const model::ValueAndBound text = model::PrintBeyond(pressure, *collapse_pa_);
  return {false,
          fmt::format("t = {:.6g} s: {}: collapse: {} Pa inward for {:.2g} s at {:.4g} mL, bound "
                      "{} Pa, beyond which no open shape is in equilibrium and the full model "
                      "closes up; lower the pressure",
                      state.time_s, model_.robot.mantle->name, text.value,
                      state.time_s - held_since_s_, 1e6 * volume, text.bound)};
}

std::vector<std::string> MantleGuard::Warnings() const {
  std::vector<std::string> out;
  if (farthest_ > kBeyondShapes) {
    out.push_back(fmt::format(
        "{}: shape coordinate {} went to {:.3g} times the largest it was built from at t = {:.4g} "
        "s, "
        "bound {}: the shapes are extrapolated; take reduced.static_pressures up to the working "
        "pressure, or the full model",
        model_.robot.mantle->name, farthest_coordinate_, farthest_, farthest_s_, kBeyondShapes));
  }
  if (above_pa_ > 0.0) {
    out.push_back(fmt::format(
        "{}: {:.4g} Pa inward at t = {:.4g} s, above {:.4g} Pa, where its static path turns: held "
        "longer it closes up; compare with the full model",
        model_.robot.mantle->name, above_pa_, above_s_, *collapse_pa_));
  }
  return out;
}

}  // namespace mantle::reduced
