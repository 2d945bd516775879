#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/simulation.h"

/// What a run says of itself at its end: energies, drift, warnings, energetic index.

namespace mantle::model {
namespace {

// Beyond these a run is warned of: a step that loses that share of the energy does not resolve the
// motion; the balance of a sound evaluation closes to round-off.
constexpr double kLargeDrift = 0.05;
constexpr double kLargeImbalance = 1e-8;

// Energies below this are round-off of a robot at rest; a drift relative to them says nothing.
constexpr double kNegligibleEnergy_j = 1e-18;

}  // namespace

void AddValidity(const Plant& plant, const ValidityRecord& record, RunResult* result) {
  result->largest_strain = record.strain(plant);
  result->lobed_buckling = record.lobed_buckling(plant);
  for (auto& w : StrainWarnings(result->largest_strain)) result->warnings.push_back(w);
  if (!result->lobed_buckling) return;
  for (auto& w : LobedBucklingWarnings(*result->lobed_buckling)) result->warnings.push_back(w);
}

void Simulation::Judge(RunResult* result) const {
  if (settings_.account_energy && result->energy_drift > kLargeDrift) {
    const StepperSettings& s = settings_.stepper;
    const std::string cure =
        s.integrator == Integrator::kCvode
            ? "lower time.relative_tolerance and time.absolute_tolerance"
            : fmt::format("halve time.step = {:.3g} s until the figure stays small{}",
                          settings_.step_s,
                          s.integrator == Integrator::kSdirk3 || s.integrator == Integrator::kRk4
                              ? ""
                              : ", or take time.integrator = \"sdirk3\"");
    result->warnings.push_back(fmt::format(
        "energy_drift = {:.2g}, bound {:.2g}: that share of {:.3g} J (the run's largest energy, or "
        "all work done and dissipated) is unaccounted for: the steps do not resolve the motion; {}",
        result->energy_drift, kLargeDrift, result->energy_drift_scale_j, cure));
  }
  if (result->power_balance_residual > kLargeImbalance) {
    result->warnings.push_back(fmt::format(
        "power_balance_residual = {:.2g} of {:.3g} W, bound {:.2g}: forces and energies disagree, "
        "which no step or mesh explains; do not use this run, and report the scene",
        result->power_balance_residual, result->power_balance_scale_w, kLargeImbalance));
  }
}

RunResult Simulation::Result() {
  RunResult result;
  result.ok = true;
  result.sim_time_s = state_.time_s;
  result.counters = counters();
  result.last = Observe();
  result.balance_defined = plant_.exact();
  result.power_balance_residual = account_.worst_balance;
  result.power_balance_scale_w = account_.worst_balance_scale_w;
  const double start_scale_w =
      std::max(account_.start_scale_w, kNegligiblePower * account_.largest_scale_w);
  if (account_.start_imbalance_w > result.power_balance_residual * start_scale_w) {
    result.power_balance_residual = account_.start_imbalance_w / start_scale_w;
    result.power_balance_scale_w = start_scale_w;
  }
  result.work_names = energy_.names();
  result.work_j = energy_.work_j();
  result.dissipated_j = energy_.dissipated_j();
  result.drops = drops_;
  double gained = -energy_.dissipated_j(), turned = energy_.dissipated_j();
  for (double w : energy_.work_j()) {
    gained += w;
    turned += std::abs(w);
  }
  const double end = result.last.energies.total();
  result.energy_drift_scale_j = std::max(account_.peak_energy_j, turned);
  if (result.energy_drift_scale_j > kNegligibleEnergy_j) {
    result.energy_drift =
        std::abs(end - account_.initial_energy_j - gained) / result.energy_drift_scale_j;
  }
  if (result.balance_defined) Judge(&result);
  AddValidity(plant_, account_.validity, &result);
  EnergeticIndex& index = result.index;
  if (account_.ratio_time_s > 0) {
    index.mean_of_ratio = account_.ratio_s / account_.ratio_time_s;
    index.positive_mean_of_ratio = account_.positive_ratio_s / account_.ratio_time_s;
  }
  if (account_.input_j > 0) {
    index.ratio_of_means = account_.output_j / account_.input_j;
    index.positive_ratio_of_means = account_.positive_output_j / account_.input_j;
  }
  if (account_.time_s > 0) {
    index.mean_output_w = account_.output_j / account_.time_s;
    index.mean_input_w = account_.input_j / account_.time_s;
  }
  return result;
}

}  // namespace mantle::model
