#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <random>

#include "model/stepper.h"

/// Classical RK4 in a chart centred at the step's start: Theta_dot = Jr^-1(Theta) v, v_dot = M^-1
/// f.

namespace mantle::model {
namespace {

constexpr std::array<double, 4> kNode = {0.0, 0.5, 0.5, 1.0};
constexpr std::array<double, 4> kWeight = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};

void ChartRate(const Plant& plant, const VectorX& theta, const VectorX& v, VectorX* rate) {
  *rate = v;
  const auto pose = [&](int at) {
    rate->segment<6>(at) = TangentOperatorInverseTimes(theta.segment<6>(at), v.segment<6>(at));
  };
  pose(0);
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    for (int k = 1; k <= plant.rods[a].element_count(); ++k) pose(plant.ArmVelocity(a, k));
  }
}

class ExplicitStepper final : public Stepper {
 public:
  ExplicitStepper(const Plant& plant, const StepperSettings& settings)
      : plant_(plant), settings_(settings), work_(plant), stage_(InitialState(plant)) {
    const int n = plant.velocity_size();
    for (VectorX* v : {&theta_, &theta_rate_, &acceleration_, &theta_sum_, &velocity_sum_}) {
      v->setZero(n);
    }
  }

  StepStatus Step(double h, PlantState* state, EnergyAccount* energy) override {
    theta_sum_.setZero();
    velocity_sum_.setZero();
    if (energy != nullptr) energy->Begin();
    for (int i = 0; i < 4; ++i) {
      const double a = kNode[i] * h;
      stage_.velocity = state->velocity + a * acceleration_ * (i > 0 ? 1.0 : 0.0);
      theta_ = (i > 0 ? a : 0.0) * theta_rate_;
      Retract(plant_, *state, theta_, &stage_);
      stage_.time_s = state->time_s + a;
      EvaluateInputs(plant_, stage_.time_s, i > 0, &inputs_);
      if (settings_.input_hook) settings_.input_hook(stage_.time_s, i > 0, &inputs_);
      ImposeRoot(plant_, inputs_, &stage_);
      ++counters_.evaluations;
      if (const EvaluationFailure failure = EvaluateForces(plant_, stage_, inputs_, &work_)) {
        ++counters_.rejected;
        return {false, failure.Message()};
      }
      SolveAcceleration(plant_, inputs_, &work_, &acceleration_);
      ChartRate(plant_, theta_, stage_.velocity, &theta_rate_);
      theta_sum_ += h * kWeight[i] * theta_rate_;
      velocity_sum_ += h * kWeight[i] * acceleration_;
      if (energy != nullptr) {
        energy->EvaluatePowers(plant_, stage_, inputs_, work_, acceleration_);
        energy->Accumulate(h * kWeight[i]);
      }
    }
    if (!theta_sum_.allFinite() || !velocity_sum_.allFinite()) {
      ++counters_.rejected;
      return {false, fmt::format("explicit step at t = {:.6g} s is not finite", state->time_s)};
    }
    Retract(plant_, *state, theta_sum_, &stage_);
    std::swap(state->pose, stage_.pose);
    std::swap(state->shape, stage_.shape);
    state->velocity += velocity_sum_;
    state->time_s += h;
    ImposeRoot(plant_, inputs_, state);
    if (energy != nullptr) energy->Commit();
    ++counters_.steps;
    return {};
  }

  const VectorX& acceleration() const override { return acceleration_; }
  const StepCounters& counters() const override { return counters_; }
  std::string SaveMemory() const override { return {}; }
  void RestoreMemory(const std::string&) override {}

 private:
  const Plant& plant_;
  StepperSettings settings_;
  PlantWork work_;
  PlantInputs inputs_;
  PlantState stage_;
  VectorX theta_, theta_rate_, acceleration_, theta_sum_, velocity_sum_;
  StepCounters counters_;
};

// |R(z)| of RK4.
double Amplification(std::complex<double> z) {
  return std::abs(1.0 + z * (1.0 + z * (0.5 + z * (1.0 / 6 + z / 24.0))));
}

double LargestStableStep(std::complex<double> root) {
  double low = 0, high = 4.0 / std::abs(root);
  // along a ray into the left half plane the region is left once
  for (int i = 0; i < 60; ++i) {
    const double mid = 0.5 * (low + high);
    (Amplification(mid * root) <= 1.0 + 1e-12 ? low : high) = mid;
  }
  return low;
}

}  // namespace

double ExplicitStepLimit(const Plant& plant) {
  constexpr int kIterations = 80;
  constexpr double kVelocityProbe = 1e-4, kShapeProbe = 1e-7, kInHand = 0.95;
  PlantState state = InitialState(plant);
  PlantInputs inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  PlantWork work(plant);
  if (const EvaluationFailure failure = EvaluateForces(plant, state, inputs, &work)) {
    throw BadRobot("initial state, for the explicit step: " + failure.Message());
  }
  const VectorX f0 = work.force;
  inputs.root_acceleration.setZero();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const int n = plant.velocity_size();
  double radius[2] = {0, 0};  // of M^-1 D and of M^-1 K
  for (int which : {0, 1}) {
    VectorX x(n), y(n);
    for (double& e : x) e = uniform(random);
    if (!plant.root_free()) x.head<6>().setZero();
    for (int k = 0; k < kIterations; ++k) {
      x /= x.norm();
      PlantState probe = state;
      const double eps = which == 0 ? kVelocityProbe : kShapeProbe;
      if (which == 0) {
        probe.velocity += eps * x;
      } else {
        Retract(plant, state, eps * x, &probe);
        ImposeRoot(plant, inputs, &probe);
      }
      if (EvaluateForces(plant, probe, inputs, &work)) break;
      work.force = (f0 - work.force) / eps;
      SolveAcceleration(plant, inputs, &work, &y);
      radius[which] = std::max(y.norm(), 0.0);
      if (!(radius[which] > 0)) break;
      x = y;
    }
  }
  const double d = radius[0], k = radius[1];
  double limit = 1.0;
  const std::complex<double> disc = std::sqrt(std::complex<double>(d * d - 4.0 * k, 0.0));
  for (const std::complex<double> root :
       {0.5 * (-d + disc), 0.5 * (-d - disc), std::complex<double>(0.0, std::sqrt(k))}) {
    if (std::abs(root) > 0) limit = std::min(limit, LargestStableStep(root));
  }
  return kInHand * limit;
}

std::unique_ptr<Stepper> MakeExplicitStepper(const Plant& plant, const StepperSettings& settings) {
  return std::make_unique<ExplicitStepper>(plant, settings);
}

}  // namespace mantle::model
