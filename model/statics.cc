#include "model/statics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/static_newton.h"

namespace mantle::model {
namespace {

using Outcome = StaticNewton::Outcome;

constexpr double kSmallestStep = 1e-6;  // of the first load step
constexpr int kMostAttempts = 30;       // for each load step, and 20 times as many in all
constexpr double kBifurcationStep = 1.0 / 1024.0;  // of it: a bifurcation is located to this
constexpr double kWantedIterations = 5;            // of an arc-length step; its length adapts
constexpr double kLongestPath = 1.0;               // of one arc-length step (rad)
constexpr double kLongestLoad = 2.0;               // of one arc-length step, in load steps
constexpr double kLimitSlope = 1e-5;               // of the first slope: the limit point is located
constexpr int kLimitSearch = 30;
// A step continues the path where it went at least this much in the direction of its tangent and
// not this many times as far. Stiffening shortens a way tenfold without leaving the path.
constexpr double kSmallestCosine = 0.3;
constexpr double kLongestWay = 4.0;
constexpr double kNoWay = 1e-6;  // rad: a way too short to have a direction
// The load is taken to be at its limit where the response to it has grown by this.
constexpr double kSoftened = 10.0;

class Statics {
 public:
  Statics(const Plant& plant, const StaticsSettings& settings,
          const std::function<void(const StaticsPoint&)>& progress)
      : plant_(plant),
        settings_(settings),
        problem_(plant, settings.time_s),
        newton_(problem_, settings.tolerance, settings.max_iterations),
        progress_(progress),
        full_step_(settings.max_load_factor / settings.load_steps) {
    result_.without_potential = LoadsWithoutPotential(plant, problem_.full_inputs());
    conservative_ = result_.without_potential.empty();
  }

  StaticsResult Solve() {
    const Outcome at_rest = newton_.AtLoad(0.0);  // cables may pull at rest
    if (at_rest != Outcome::kConverged) {
      result_.reason = Explain(at_rest);
      return Finish(false);
    }
    stability_ = JudgeStability(problem_, conservative_, &newton_);
    Record();
    if (!newton_.Tangent(&tangent_, &path_)) {
      result_.reason = Explain(Outcome::kSingular);
      return Finish(false);
    }
    first_response_ = path_.norm();
    const bool ok = settings_.arc_length ? TraceArc() : TraceLoad();
    return Finish(ok);
  }

 private:
  double load() const { return newton_.load_factor; }

  void Record() {
    StaticsPoint p;
    p.load_factor = load();
    p.volume_m3 = plant_.shell ? ShellVolume(newton_.state.shape) : 0.0;
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      p.tips_m.push_back(
          AbsolutePose(plant_, newton_.state, a, plant_.rods[a].element_count()).position);
    }
    p.unstable_directions = stability_.unstable_directions;
    result_.path.push_back(p);
    if (progress_) progress_(p);
  }

  // Whether the last step went where its tangent pointed.
  bool Continues() const {
    const double way = newton_.travelled().norm(), foreseen = newton_.foreseen().norm();
    if (way < kNoWay) return true;
    const double cosine = newton_.travelled().dot(newton_.foreseen()) / (way * foreseen);
    return cosine > kSmallestCosine && way < kLongestWay * foreseen;
  }

  bool TraceLoad() {
    double step = full_step_;
    const double end = settings_.max_load_factor;
    const int most = kMostAttempts * std::min(settings_.load_steps + 20, 10000);
    int attempts = 0;
    while (load() < end * (1 - 1e-12)) {
      const StaticState before = newton_.state;
      const double from = load();
      const auto back = [&](double to) {
        newton_.state = before;
        newton_.load_factor = from;
        step = 0.5 * (to - from);
      };
      // Whole load steps stay on their grid also after shorter ones.
      const double grid = (std::floor(from / full_step_ + 1e-9) + 1.0) * full_step_;
      const double to = std::min({from + step, grid, end});
      ++attempts;
      const Outcome outcome = newton_.AtLoad(to > end - 1e-9 * full_step_ ? end : to);
      const bool jumped = outcome == Outcome::kConverged && !Continues();
      if (outcome != Outcome::kConverged || jumped) {
        back(to);
        if (step < kSmallestStep * full_step_ || attempts > most) {
          result_.reason = jumped ? Beyond(kJump) : Explain(outcome);
          return false;
        }
        continue;
      }
      const Stability now = JudgeStability(problem_, conservative_, &newton_);
      if (now.unstable_directions != stability_.unstable_directions) {
        if (conservative_ && load() - from > kBifurcationStep * full_step_ * 1.001) {
          back(to);
          continue;
        }
        result_.bifurcation_load_factors.push_back(0.5 * (from + load()));
      }
      stability_ = now;
      const bool settled = step > 0.5 * full_step_ || load() >= end * (1 - 1e-12);
      if (settings_.branch == StaticBranch::kStable && conservative_ && settled &&
          stability_.unstable_directions > 0 && LeaveUnstableBranch(problem_, &newton_)) {
        stability_ = JudgeStability(problem_, conservative_, &newton_);
      }
      Record();
      step = std::min(2.0 * step, full_step_);
    }
    return true;
  }

  struct Place {
    StaticState state;
    VectorX direction;
    StaticStep tangent;
    double load, slope;
    Stability stability;
  };
  Place Here() const { return {newton_.state, direction_, tangent_, load(), slope_, stability_}; }
  void GoTo(const Place& place) {
    newton_.state = place.state;
    newton_.load_factor = place.load;
    direction_ = place.direction;
    tangent_ = place.tangent;
    slope_ = place.slope;
    stability_ = place.stability;
  }

  // Unit direction and slope d lambda / d s of the path where newton_ stands, onward from the last
  // direction (at the start: to rising load).
  bool Orient() {
    if (!newton_.Tangent(&tangent_, &path_)) return false;
    const double size = path_.norm();
    const double sign = direction_.size() == 0 || path_.dot(direction_) >= 0 ? 1.0 : -1.0;
    slope_ = sign / size;
    direction_ = slope_ * path_;
    return std::isfinite(slope_);
  }

  Outcome ArcStep(double ds) { return newton_.AlongPath(direction_, ds, tangent_, slope_ * ds); }

  // The limit point between `rising` (slope > 0) and `ds` beyond it, where the slope is `falling`,
  // to its far side: Illinois' regula falsi on the slope, from `rising` each time.
  bool LocateLimit(const Place& rising, double ds, double falling) {
    double low = 0, high = ds, at_low = rising.slope, at_high = falling;
    const double wanted = kLimitSlope / first_response_;
    int side = 0;
    for (int k = 0; k < kLimitSearch; ++k) {
      const double at = low + (high - low) * at_low / (at_low - at_high);
      GoTo(rising);
      if (ArcStep(at) != Outcome::kConverged || !Orient()) return false;
      if (slope_ > 0) {
        low = at;
        at_low = slope_;
        if (side > 0) at_high *= 0.5;
        side = 1;
      } else {
        if (-slope_ < wanted) return true;
        high = at;
        at_high = slope_;
        if (side < 0) at_low *= 0.5;
        side = -1;
      }
    }
    GoTo(rising);
    return ArcStep(high) == Outcome::kConverged && Orient();
  }

  bool TraceArc() {
    if (!Orient()) {
      result_.reason = Explain(Outcome::kSingular);
      return false;
    }
    double ds = full_step_ / std::abs(slope_);
    const double shortest = kSmallestStep * ds;
    while (static_cast<int>(result_.path.size()) < settings_.max_points) {
      ds = std::min({ds, kLongestPath, kLongestLoad * full_step_ / std::abs(slope_)});
      const Place before = Here();
      const Outcome outcome = ArcStep(ds);
      const bool converged = outcome == Outcome::kConverged && Continues() && Orient() &&
                             direction_.dot(before.direction) > kSmallestCosine;
      if (!converged) {
        GoTo(before);
        ds *= 0.5;
        if (ds < shortest) {
          result_.reason = outcome == Outcome::kConverged ? Beyond(kJump) : Explain(outcome);
          return false;
        }
        continue;
      }
      stability_ = JudgeStability(problem_, conservative_, &newton_);
      if (before.slope > 0 && slope_ < 0 && !result_.limit_load_factor) {
        if (!LocateLimit(before, ds, slope_)) {
          result_.reason = Explain(Outcome::kDiverged);
          GoTo(before);
          return false;
        }
        stability_ = JudgeStability(problem_, conservative_, &newton_);
        result_.limit_load_factor = load();
        Record();
        if (settings_.stop_at_limit) return true;
        ds *= 0.5;
        continue;
      }
      const bool turned = before.slope * slope_ < 0;
      if (!turned && stability_.unstable_directions != before.stability.unstable_directions &&
          !PastLimit(before)) {
        result_.bifurcation_load_factors.push_back(0.5 * (before.load + load()));
      }
      if (load() >= settings_.max_load_factor) {
        const Outcome end = newton_.AtLoad(settings_.max_load_factor);
        if (end != Outcome::kConverged) {
          result_.reason = Explain(end);
          return false;
        }
        stability_ = JudgeStability(problem_, conservative_, &newton_);
        Record();
        return true;
      }
      Record();
      if (result_.limit_load_factor && load() <= 0.0) return true;
      ds *= std::clamp(std::sqrt(kWantedIterations / newton_.last_iterations()), 0.5, 2.0);
    }
    result_.reason = fmt::format(
        "statics.max_points = {}: the path has that many points and has only come to load factor "
        "{:.6g} of {:.6g}; must be larger, or statics.load_steps smaller (longer steps)",
        settings_.max_points, load(), settings_.max_load_factor);
    return false;
  }

  // At the point located as a limit the sign of the last pivot is round-off.
  bool PastLimit(const Place& before) const {
    return result_.limit_load_factor && before.load == *result_.limit_load_factor;
  }

  enum Kind { kLimit, kJump, kOther };

  // How a path ends that does not go on, with what to do about it.
  std::string Beyond(Kind kind, const std::string& cause = {}) {
    const std::string where = fmt::format("no equilibrium beyond load factor {:.6g}: ", load());
    if (kind == kLimit) {
      return where + fmt::format(
                         "a limit point lies there (the response to more load is {:.3g} times that "
                         "at rest); statics.arc_length = true passes it",
                         path_.norm() / first_response_);
    }
    if (kind == kJump) {
      return where +
             "the equilibria near the next load lie on another branch, the path jumps there; "
             "statics.arc_length = true follows it, or a load to the side leads past it";
    }
    return where + cause;
  }

  std::string Explain(Outcome outcome) {
    const std::string cause = newton_.reason();
    const bool tangent = newton_.Tangent(&tangent_, &path_);
    if (outcome == Outcome::kNotAState) return Beyond(kOther, cause);
    if (outcome == Outcome::kRoundOff) {
      return Beyond(kOther, fmt::format("{}: round-off of these stiffnesses; statics.tolerance = "
                                        "{:.1e} must be larger",
                                        cause, settings_.tolerance));
    }
    if (tangent && !settings_.arc_length && first_response_ > 0.0 &&
        path_.norm() > kSoftened * first_response_) {
      return Beyond(kLimit);
    }
    switch (outcome) {
      case Outcome::kSingular:
        return Beyond(kOther, cause + ": the robot has a direction without stiffness");
      case Outcome::kIterations:
        return Beyond(kOther, fmt::format("{}; statics.max_iterations = {} must be larger", cause,
                                          settings_.max_iterations));
      default:
        return Beyond(kOther, fmt::format("{}, and no limit point is near; the mesh may be too "
                                          "coarse for the shape there (more elements)",
                                          cause));
    }
  }

  StaticsResult Finish(bool ok) {
    result_.ok = ok;
    if (ok) result_.reason.clear();
    PlantInputs inputs;
    PlantWork work(plant_);
    problem_.Evaluate(load(), &newton_.state, &inputs, &work);
    result_.residual_n = work.force.cwiseAbs().maxCoeff();
    for (std::size_t a = 0; a < plant_.rods.size(); ++a) {
      const Rod& rod = plant_.rods[a];
      for (int i = 0; i < rod.element_count(); ++i) {
        Vector6 stress = RodStress(rod.elements[i], work.rod[a][i]);
        AddCoupledStress(rod, i, work.rod[a][i], work.muscles[a], &stress);
        const double held = stress.cwiseAbs().maxCoeff();
        result_.internal_force_n = std::max(result_.internal_force_n, held);
      }
    }
    result_.state = newton_.state;
    result_.load_factor = load();
    result_.stability = stability_;
    result_.iterations = newton_.iterations();
    result_.cable_length_m = work.cable_length_m;
    result_.cable_tension_n = work.cable_tension_n;
    return result_;
  }

  const Plant& plant_;
  StaticsSettings settings_;
  StaticProblem problem_;
  StaticNewton newton_;
  StaticsResult result_;
  std::function<void(const StaticsPoint&)> progress_;
  StaticStep tangent_;
  VectorX path_, direction_;  // dq/dlambda (tangent_) in path coordinates, unit direction
  Stability stability_;
  double slope_{0}, first_response_{0}, full_step_;
  bool conservative_{true};
};

}  // namespace

StaticsResult SolveStatics(const Plant& plant, const StaticsSettings& settings,
                           const std::function<void(const StaticsPoint&)>& progress) {
  return Statics(plant, settings, progress).Solve();
}

}  // namespace mantle::model
