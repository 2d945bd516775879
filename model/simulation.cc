#include "model/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/mantle_loads.h"
#include "model/observation.h"

namespace mantle::model {
namespace {

constexpr double kSameTime_s = 1e-12;

void RefuseTolerance(const StepperSettings& s) {
  if (s.step_tolerance == 0.0) return;
  if (s.integrator == Integrator::kCvode) {
    throw BadRobot(
        "time.tolerance: cvode has time.relative_tolerance and time.absolute_tolerance instead");
  }
  if (s.integrator == Integrator::kRk4) {
    throw BadRobot(
        "time.tolerance: rk4's steps are bound by stability and are not error-controlled; use an "
        "implicit integrator");
  }
  if (s.input_hook) {
    throw BadRobot("time.tolerance: steps of a closed loop are its own; leave the tolerance at 0");
  }
}

}  // namespace

StepStatus JudgeThrust(const Plant& plant, double time_s, double thrust_n) {
  const auto& jet = plant.robot.effects.jet_thrust;
  if (!jet || std::abs(thrust_n) <= jet->runaway_n) return {};
  // A rising lip shrinks the volume, which raises the thrust, which lifts the lip: only where the
  // flux counts the lip's motion and the thrust acts on it ([physics.md] 3).
  const ValueAndBound text = PrintBeyond(std::abs(thrust_n), jet->runaway_n);
  const bool feedback = jet->flux == FluxReading::kVolume && jet->place == ThrustPlace::kUniform;
  return {false,
          fmt::format(
              "jet_thrust ran away at t = {:.6g} s: thrust {} N, bound jet_thrust.runaway = "
              "{} N; {}",
              time_s, text.value, text.bound,
              feedback ? "a rising lip shrinks the volume, which raises the thrust: flux = "
                         "\"radial\" or place = \"dome\" removes that"
                       : "the wall itself moves that fast: lower the pressure or tension on it, or "
                         "raise the bound if such a thrust is meant")};
}

Simulation::Simulation(const Plant& plant, const RunSettings& settings)
    : plant_(plant),
      settings_(settings),
      state_(StartState(plant, settings.statics)),
      energy_(plant),
      probe_(plant),
      work_(plant),
      acceleration_(VectorX::Zero(plant.velocity_size())),
      gradient_(plant.shape_count(), Vector3::Zero()),
      step_cap_(settings.step_s),
      step_control_(settings.step_s, OrderOf(settings.stepper.integrator)) {
  RefuseTolerance(settings.stepper);
  if (settings.stepper.integrator == Integrator::kRk4) {
    const double limit = ExplicitStepLimit(plant);
    if (settings.step_s > limit) {
      throw BadRobot(
          fmt::format("time.step = {:.6g} s: explicit RK4 is stable up to about {:.3g} s "
                      "for this robot; use a smaller step or an implicit integrator",
                      settings.step_s, limit));
    }
  }
  stepper_ = MakeStepper(plant, settings.stepper);
  EvaluateInputs(plant_, 0.0, false, &inputs_);
  if (settings_.stepper.input_hook) settings_.stepper.input_hook(0.0, false, &inputs_);
  if (const EvaluationFailure failure = EvaluateForces(plant_, state_, inputs_, &work_)) {
    throw BadRobot("initial state: " + failure.Message());
  }
  const Energies start = EvaluateEnergies(plant_, state_, work_);
  account_.initial_energy_j = start.total();
  account_.peak_energy_j = start.magnitude();
}

StepCounters Simulation::counters() const {
  StepCounters c = stepper_->counters();
  c.steps += before_resume_.steps;
  c.rejected += before_resume_.rejected;
  c.newton_iterations += before_resume_.newton_iterations;
  c.factorisations += before_resume_.factorisations;
  c.evaluations += before_resume_.evaluations;
  return c;
}

StepStatus Simulation::CheckRunaway() const {
  if (!plant_.robot.effects.jet_thrust) return {};
  const JetThrust& jet = *plant_.robot.effects.jet_thrust;
  ShellVolumeGradient(state_.shape, &gradient_);
  double flux = 0;
  for (int j = 0; j < plant_.shape_count(); ++j) {
    Vector3 v = state_.velocity.segment<3>(plant_.ShellVelocity(j));
    if (jet.flux == FluxReading::kRadial) v(1) = 0;
    flux += gradient_[j].dot(v);
  }
  return JudgeThrust(plant_, state_.time_s,
                     FindLoad<JetLoad>(plant_.mantle_loads)->Evaluate(flux).thrust_n);
}

StepStatus Simulation::TakeStep(double limit_s) {
  const double breakpoint = NextBreakpoint(plant_, state_.time_s);
  // A limit that misses the break point by round-off must not hide it.
  const bool at_breakpoint = breakpoint <= limit_s + kSameTime_s;
  const double next = at_breakpoint ? breakpoint : limit_s;
  const bool adaptive = settings_.stepper.integrator == Integrator::kCvode;
  StepStatus status;
  for (;;) {
    const double remaining = next - state_.time_s;
    const double longest = settings_.stepper.step_tolerance > 0.0
                               ? std::min(step_cap_.now_s(), step_control_.now_s())
                               : step_cap_.now_s();
    const double count = adaptive ? 1.0 : std::ceil(remaining / longest - 1e-9);
    const double h = remaining / std::max(count, 1.0);
    status = stepper_->Step(h, &state_, settings_.account_energy ? &energy_ : nullptr);
    if (status.ok) {
      if (count <= 1.0) {
        state_.time_s = next;
        if (at_breakpoint) stepper_->CrossBreakpoint();
      }
      step_cap_.Hold();
      step_control_.Accept(h, status.error_ratio);
      if (settings_.account_energy) AccountStep(h);
      if (count <= 1.0 && at_breakpoint) {
        DropPayloads();
        status = CrossKink();
      }
      return status.ok ? CheckRunaway() : status;
    }
    if (adaptive || 0.5 * h < settings_.min_step_s) {
      status.reason = fmt::format("t = {:.6g} s: {}", state_.time_s, status.reason);
      return status;
    }
    if (status.error_ratio > 1.0) {
      step_control_.Refuse(h, status.error_ratio);
    } else {
      step_cap_.Fail(h);
    }
  }
}

// A payload leaves with the velocity it has; nobody else's changes.
void Simulation::DropPayloads() {
  for (const PayloadDrop& drop : DropsAt(plant_, state_)) {
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      const int k = drop.payload - plant_.PayloadIndex(a, 0);
      if (k < 0 || k >= static_cast<int>(plant_.rods[a].payloads.size())) continue;
      energy_.AddWork(plant_.rods[a].payloads[k].power_place, -drop.kinetic_energy_j);
    }
    drops_.push_back(drop);
  }
}

StepStatus Simulation::CrossKink() {
  if (!std::holds_alternative<PrescribedRoot>(plant_.robot.root)) return {};
  // Of what is attached from now on: a payload that leaves here has been accounted for.
  EvaluateInputs(plant_, state_.time_s, false, &inputs_);
  EvaluateForces(plant_, state_, inputs_, &work_);
  const double before_j = EvaluateEnergies(plant_, state_, work_).total();
  if (const EvaluationFailure failure = CrossRootKink(plant_, &inputs_, &work_, &state_)) {
    return {false, fmt::format("t = {:.6g} s: after the kink of the root's motion: {}",
                               state_.time_s, failure.Message())};
  }
  EvaluateForces(plant_, state_, inputs_, &work_);
  energy_.AddWork(plant_.constraint_place,
                  EvaluateEnergies(plant_, state_, work_).total() - before_j);
  return {};
}

StepStatus Simulation::AdvanceTo(double t_s) {
  while (state_.time_s < t_s - kSameTime_s) {
    if (StepStatus status = TakeStep(t_s); !status.ok) return status;
  }
  return {};
}

const PlantWork& Simulation::EndWork() {
  if (const PlantWork* work = stepper_->end_work();
      work != nullptr && stepper_->counters().steps > 0) {
    return *work;
  }
  EvaluateInputs(plant_, state_.time_s, true, &inputs_);
  if (settings_.stepper.input_hook) settings_.stepper.input_hook(state_.time_s, true, &inputs_);
  EvaluateForces(plant_, state_, inputs_, &work_);
  return work_;
}

void Simulation::AccountStep(double h) {
  const VectorX& a = stepper_->acceleration();
  const EnergyAccount* powers = &energy_;
  const PlantWork* work = stepper_->end_work();
  if (work == nullptr) {
    EvaluateInputs(plant_, state_.time_s, true, &inputs_);
    if (settings_.stepper.input_hook) settings_.stepper.input_hook(state_.time_s, true, &inputs_);
    if (EvaluateForces(plant_, state_, inputs_, &work_)) return;
    probe_.EvaluatePowers(plant_, state_, inputs_, work_, a);
    powers = &probe_;
    work = &work_;
  }
  const double output = LockedPower(plant_, state_, *work, a.head<6>());
  const double input =
      std::max(powers->stress_power_arms_w(), 0.0) + std::max(powers->stress_power_mantle_w(), 0.0);
  account_.time_s += h;
  account_.output_j += h * output;
  account_.positive_output_j += h * std::max(output, 0.0);
  account_.input_j += h * input;
  if (input > 0.0) {
    account_.ratio_time_s += h;
    account_.ratio_s += h * output / input;
    account_.positive_ratio_s += h * std::max(output, 0.0) / input;
  }
}

Sample ObserveState(const Plant& plant, const PlantState& state, const PlantWork& work,
                    const VectorX& acceleration) {
  const WaterMotion water = EvaluateWater(plant.robot.effects, state.time_s);
  const Vector3 &current = water.velocity_m_s, &drift = water.drift_m;
  const auto pose = [&](Pose g) {
    g.position += drift;
    return g;
  };
  const auto twist = [&](Vector6 eta, const Pose& g) {
    eta.tail<3>() += g.rotation.conjugate() * current;
    return eta;
  };
  Sample s;
  s.time_s = state.time_s;
  s.root = pose(state.pose[0]);
  s.root_twist = twist(state.velocity.head<6>(), state.pose[0]);
  s.root_acceleration = acceleration.head<6>();
  const Vector3 carried = state.pose[0].rotation.conjugate() * current;
  s.root_acceleration.tail<3>() -= state.velocity.head<3>().cross(carried);  // its axes turn
  s.root_acceleration.tail<3>() += state.pose[0].rotation.conjugate() * water.acceleration_m_s2;
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    const int n = plant.rods[a].element_count();
    const Pose tip = AbsolutePose(plant, state, a, n);
    s.tips.push_back(pose(tip));
    s.tip_twists.push_back(twist(AbsoluteTwist(plant, state, a, n), tip));
  }
  s.centre_of_mass_m = EvaluateSolidMotion(plant, state, work).centre_m;
  s.momentum = EvaluateMomentum(plant, state, work);
  s.energies = EvaluateEnergies(plant, state, work);
  s.volume_m3 = work.volume_m3;
  s.volume_rate_m3_s = work.volume_rate_m3_s;
  s.thrust_n = work.thrust_n;
  s.cable_length_m = work.cable_length_m;
  s.cable_rate_m_s = work.cable_rate_m_s;
  s.cable_tension_n = work.cable_tension_n;
  return s;
}

Sample Simulation::Observe() {
  EvaluateInputs(plant_, state_.time_s, false, &inputs_);
  if (settings_.stepper.input_hook) settings_.stepper.input_hook(state_.time_s, false, &inputs_);
  EvaluateForces(plant_, state_, inputs_, &work_);
  SolveAcceleration(plant_, inputs_, &work_, &acceleration_);
  probe_.EvaluatePowers(plant_, state_, inputs_, work_, acceleration_);
  const EnergyAccount::Balance balance =
      probe_.EvaluateBalance(plant_, state_, work_, acceleration_);
  account_.largest_scale_w = std::max(account_.largest_scale_w, balance.scale_w);
  account_.validity.Add(plant_, inputs_, work_, state_.time_s);
  Sample s = ObserveState(plant_, state_, work_, acceleration_);
  account_.peak_energy_j = std::max(account_.peak_energy_j, s.energies.magnitude());
  s.power_balance_scale_w = std::max({balance.scale_w, kNegligiblePower * account_.largest_scale_w,
                                      s.energies.magnitude() / settings_.duration_s});
  if (plant_.exact() && s.power_balance_scale_w > 0.0) {
    s.power_balance_residual = std::abs(balance.residual_w) / s.power_balance_scale_w;
    if (counters().steps == 0) {
      // At rest powers are round-off; what they are small against the run will show.
      account_.start_imbalance_w = std::abs(balance.residual_w);
      account_.start_scale_w = s.power_balance_scale_w;
    } else if (s.power_balance_residual >= account_.worst_balance) {
      account_.worst_balance = s.power_balance_residual;
      account_.worst_balance_scale_w = s.power_balance_scale_w;
    }
  }
  s.index_output_w = LockedPower(plant_, state_, work_, acceleration_.head<6>());
  s.index_input_w =
      std::max(probe_.stress_power_arms_w(), 0.0) + std::max(probe_.stress_power_mantle_w(), 0.0);
  return s;
}

RunResult Simulation::Run(const std::function<bool(const Sample&)>& observer) {
  Sample sample = Observe();
  bool go = state_.time_s > 0.0 || !observer || observer(sample);
  const bool every_step = settings_.output_interval_s <= settings_.step_s;
  StepStatus status;
  while (go && status.ok && state_.time_s < settings_.duration_s - kSameTime_s) {
    const double interval = settings_.output_interval_s;
    const double due = (std::floor(state_.time_s / interval + 1e-9) + 1.0) * interval;
    const double target = std::min(due, settings_.duration_s);
    status = every_step && settings_.stepper.integrator != Integrator::kCvode
                 ? TakeStep(settings_.duration_s)
                 : AdvanceTo(target);
    if (!status.ok) break;
    sample = Observe();
    if (observer) go = observer(sample);
  }
  RunResult result = Result();
  result.ok = status.ok;
  result.reason = status.reason;
  return result;
}

}  // namespace mantle::model
