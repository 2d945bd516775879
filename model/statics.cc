#include "model/statics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/newton_matrix.h"

namespace mantle::model {
namespace {

constexpr double kMaxIncrement = 0.5;      // rad or body lengths: an iteration beyond has failed
constexpr int kWantedIterations = 5;       // of an arc-length step; its length adapts to this
constexpr double kLimitResolution = 1e-4;  // of the path's length scale: the load there is off by
                                           // the square of it
constexpr double kSmallestStep = 1e-6;     // of the first load step

void Scale(const Plant& plant, const PlantInputs& full, double factor, PlantInputs* inputs) {
  *inputs = full;
  inputs->gravity_scale = factor;
  inputs->normal_pressure_pa *= factor;
  for (double& x : inputs->distributed) x *= factor;
  for (double& x : inputs->points) x *= factor;
  for (double& x : inputs->strips_pa) x *= factor;
  int at = 0;
  const auto rest = [&](double length) {
    CableInput& c = inputs->cables[at++];
    c.tension_n *= factor;
    c.reel_m = length + factor * (c.reel_m - length);
    c.reel_rate_m_s = 0;
  };
  for (const Rod& rod : plant.rods) {
    for (const RodCable& c : rod.cables) rest(c.rest_length_m);
  }
  if (plant.shell) {
    for (const ShellSpokes& s : plant.shell->spokes) rest(s.rest_length_m);
  }
}

class Statics {
 public:
  Statics(const Plant& plant, const StaticsSettings& settings)
      : plant_(plant),
        settings_(settings),
        matrix_(plant),
        work_(plant),
        state_(InitialState(plant)),
        trial_(state_) {
    state_.velocity.setZero();
    trial_.velocity.setZero();
    state_.time_s = trial_.time_s = settings.time_s;
    EvaluateInputs(plant, settings.time_s, false, &full_);
    full_.root_twist.setZero();
    full_.root_acceleration.setZero();
    const int n = plant.velocity_size();
    for (VectorX* v : {&residual_, &step_, &total_, &load_, &previous_}) v->setZero(n);
  }

  StaticsResult Solve(const std::function<void(const StaticsPoint&)>& progress) {
    progress_ = progress;
    if (!Equilibrate(0.0)) return Finish(false);  // a robot may be loaded by its cables at rest
    Record();
    const bool ok = settings_.arc_length ? TraceArc() : TraceLoad();
    return Finish(ok);
  }

 private:
  // Scaled size of an increment.
  double Size(const VectorX& x) const {
    double angular = 0, linear = 0;
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      for (int i = 1; i <= plant_.rods[a].element_count(); ++i) {
        const int at = plant_.ArmVelocity(a, i);
        angular = std::max(angular, x.segment<3>(at).cwiseAbs().maxCoeff());
        linear = std::max(linear, x.segment<3>(at + 3).cwiseAbs().maxCoeff());
      }
    }
    for (int j = 0; j < plant_.shape_count(); ++j) {
      const int at = plant_.ShellVelocity(j);
      linear = std::max(linear, x.segment<2>(at).cwiseAbs().maxCoeff());
      angular = std::max(angular, std::abs(x(at + 2)));
    }
    return std::max(angular, linear / plant_.body_length_m);
  }

  // residual_ = f at trial_, lambda; factors the tangent.
  bool Linearise(double lambda) {
    Scale(plant_, full_, lambda, &inputs_);
    if (const EvaluationFailure failure = EvaluateForces(plant_, trial_, inputs_, &work_)) {
      reason_ = failure.Message();
      return false;
    }
    residual_ = work_.force;
    residual_.head<6>().setZero();
    if (!matrix_.Factor(plant_, trial_, inputs_, work_, 0.0, 0.0)) {
      reason_ = "stiffness matrix is singular";
      return false;
    }
    return true;
  }

  // df/dlambda at trial_ by central difference of the (nearly linear) loads.
  bool LoadDerivative(double lambda) {
    constexpr double kProbe = 1e-4;
    PlantInputs inputs;
    load_.setZero();
    for (double sign : {1.0, -1.0}) {
      Scale(plant_, full_, lambda + sign * kProbe, &inputs);
      if (EvaluateForces(plant_, trial_, inputs, &work_)) return false;
      load_ += (sign / (2.0 * kProbe)) * work_.force;
    }
    load_.head<6>().setZero();
    return true;
  }

  void Move(const VectorX& x) {
    Retract(plant_, PlantState(trial_), x, &trial_);
    ImposeRoot(plant_, full_, &trial_);
  }

  // Newton at fixed load.
  bool Equilibrate(double lambda) {
    trial_ = state_;
    for (int k = 0; k < settings_.max_iterations; ++k) {
      if (!Linearise(lambda)) return false;
      ++iterations_;
      step_ = residual_;
      matrix_.Solve(plant_, &step_);
      const double size = Size(step_);
      if (!std::isfinite(size)) {
        reason_ = "an increment is not finite";
        return false;
      }
      if (size > kMaxIncrement) step_ *= kMaxIncrement / size;
      Move(step_);
      if (size < settings_.tolerance) return Accept(lambda);
    }
    reason_ = fmt::format("no equilibrium at load factor {:.6g} in {} iterations", lambda,
                          settings_.max_iterations);
    return false;
  }

  bool Accept(double lambda) {
    Scale(plant_, full_, lambda, &inputs_);
    if (const EvaluationFailure failure = EvaluateForces(plant_, trial_, inputs_, &work_)) {
      reason_ = failure.Message();
      return false;
    }
    residual_ = work_.force;
    residual_.head<6>().setZero();
    state_ = trial_;
    lambda_ = lambda;
    return true;
  }

  void Record() {
    StaticsPoint p;
    p.load_factor = lambda_;
    p.volume_m3 = plant_.shell ? ShellVolume(state_.shape) : 0.0;
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      p.tips_m.push_back(AbsolutePose(plant_, state_, a, plant_.rods[a].element_count()).position);
    }
    p.stability = matrix_.DeterminantSign(plant_);
    result_.path.push_back(p);
    if (progress_) progress_(p);
  }

  // Load steps, halved where Newton fails.
  bool TraceLoad() {
    double step = settings_.max_load_factor / settings_.load_steps;
    const double smallest = kSmallestStep * std::abs(step);
    while (lambda_ < settings_.max_load_factor * (1 - 1e-12)) {
      const double next = std::min(lambda_ + step, settings_.max_load_factor);
      if (Equilibrate(next)) {
        Record();
        step = std::min(1.5 * step, settings_.max_load_factor / settings_.load_steps);
        continue;
      }
      step *= 0.5;
      if (step < smallest) {
        reason_ = fmt::format(
            "no equilibrium beyond load factor {:.6g}: {}; a limit point may lie "
            "there (arc_length passes it)",
            lambda_, reason_);
        return false;
      }
    }
    return true;
  }

  // total_ (a chart at state_) moved by the body increment step_.
  void AddToTotal() {
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      for (int i = 1; i <= plant_.rods[a].element_count(); ++i) {
        const int at = plant_.ArmVelocity(a, i);
        const Vector6 total = total_.segment<6>(at);
        total_.segment<6>(at) += TangentOperatorInverseTimes(total, step_.segment<6>(at));
      }
    }
    const int shape = 3 * plant_.shape_count();
    total_.tail(shape) += step_.tail(shape);
  }

  // One arc-length step of length ds from state_ along `direction`; false where it does not
  // converge.
  bool ArcStep(double ds, int* used) {
    trial_ = state_;
    double lambda = lambda_;
    if (!Linearise(lambda) || !LoadDerivative(lambda)) return false;
    step_ = load_;
    matrix_.Solve(plant_, &step_);
    // Forward: along the previous increment; at the start, rising load.
    double sign = previous_.isZero(0.0) ? 1.0 : (step_.dot(previous_) >= 0 ? 1.0 : -1.0);
    const double dlambda = sign * ds / step_.norm();
    total_ = dlambda * step_;
    lambda += dlambda;
    trial_ = state_;
    Retract(plant_, state_, total_, &trial_);
    ImposeRoot(plant_, full_, &trial_);
    for (int k = 0; k < settings_.max_iterations; ++k) {
      if (!Linearise(lambda) || !LoadDerivative(lambda)) return false;
      ++iterations_;
      matrix_.Solve(plant_, &residual_);
      matrix_.Solve(plant_, &load_);
      // |total + residual + dl load| = ds, linearised about the current point (Ramm's updated plane
      // through Crisfield's cylinder): total . (residual + dl load) = (ds^2 - |total|^2) / 2
      const double along = total_.dot(load_);
      const double correction =
          (0.5 * (ds * ds - total_.squaredNorm()) - total_.dot(residual_)) / along;
      step_ = residual_ + correction * load_;
      const double size = Size(step_);
      if (!std::isfinite(size) || size > kMaxIncrement) {
        reason_ = "arc-length iteration does not converge";
        return false;
      }
      lambda += correction;
      AddToTotal();
      Retract(plant_, state_, total_, &trial_);
      ImposeRoot(plant_, full_, &trial_);
      *used = k + 1;
      if (size < settings_.tolerance) {
        const VectorX keep = total_;
        if (!Accept(lambda)) return false;
        previous_ = keep;
        return true;
      }
    }
    reason_ = "arc-length iteration does not converge";
    return false;
  }

  struct Place {
    PlantState state;
    VectorX direction;
    double lambda;
  };
  Place Here() const { return {state_, previous_, lambda_}; }
  void GoTo(const Place& place) {
    state_ = place.state;
    previous_ = place.direction;
    lambda_ = place.lambda;
  }

  bool TraceArc() {
    // First step: as long as the first load step would be.
    if (!Linearise(0.0) || !LoadDerivative(0.0)) return false;
    step_ = load_;
    matrix_.Solve(plant_, &step_);
    double ds = step_.norm() * settings_.max_load_factor / settings_.load_steps;
    const double longest = 4.0 * ds, shortest = kSmallestStep * ds;
    Place older = Here();
    bool stepped = false;  // from `older` to where the next step starts
    while (static_cast<int>(result_.path.size()) < settings_.max_points) {
      const Place before = Here();
      int used = 0;
      if (!ArcStep(ds, &used)) {
        GoTo(before);
        ds *= 0.5;
        if (ds < shortest) {
          reason_ = fmt::format("path stops at load factor {:.6g}: {}", lambda_, reason_);
          return false;
        }
        continue;
      }
      if (lambda_ < before.lambda && !result_.limit_load_factor) {
        // The maximum lies between the point before the last and here (the last may be past it
        // already): from there again, with shorter steps.
        if (ds > kLimitResolution * longest) {
          GoTo(older);
          if (stepped) result_.path.pop_back();
          stepped = false;
          locating_ = true;
          ds *= 0.5;
          continue;
        }
        locating_ = false;
        result_.limit_load_factor = std::max(before.lambda, lambda_);
        Record();
        if (settings_.stop_at_limit) return true;
        ds = 0.02 * longest;
        continue;
      }
      Record();
      older = before;
      stepped = true;
      if (lambda_ >= settings_.max_load_factor) {
        return Equilibrate(settings_.max_load_factor) && (Record(), true);
      }
      if (result_.limit_load_factor && lambda_ <= 0.0) return true;
      if (!locating_) {
        ds *= std::clamp(std::sqrt(static_cast<double>(kWantedIterations) / used), 0.5, 1.5);
        ds = std::min(ds, longest);
      }
    }
    return true;
  }

  StaticsResult Finish(bool ok) {
    result_.ok = ok;
    result_.reason = ok ? "" : reason_;
    Scale(plant_, full_, lambda_, &inputs_);
    EvaluateForces(plant_, state_, inputs_, &work_);
    result_.residual_n = work_.force.tail(work_.force.size() - 6).cwiseAbs().maxCoeff();
    result_.state = state_;
    result_.load_factor = lambda_;
    result_.iterations = iterations_;
    result_.cable_length_m = work_.cable_length_m;
    result_.cable_tension_n = work_.cable_tension_n;
    return result_;
  }

  const Plant& plant_;
  StaticsSettings settings_;
  NewtonMatrix matrix_;
  PlantWork work_;
  PlantInputs full_, inputs_;
  PlantState state_, trial_;
  VectorX residual_, step_, total_, load_, previous_;
  StaticsResult result_;
  std::function<void(const StaticsPoint&)> progress_;
  std::string reason_;
  double lambda_{0};
  int iterations_{0};
  bool locating_{false};
};

}  // namespace

StaticsResult SolveStatics(const Plant& plant, const StaticsSettings& settings,
                           const std::function<void(const StaticsPoint&)>& progress) {
  if (plant.root_free()) {
    throw BadRobot(
        "robot.root = \"free\": statics needs a clamped root, a free robot has no unique "
        "equilibrium");
  }
  return Statics(plant, settings).Solve(progress);
}

}  // namespace mantle::model
