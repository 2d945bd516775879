#include <algorithm>
#include <limits>

#include "controller/controller.h"
#include "controller/exchange.h"
#include "controller/parting.h"
#include "controller/plan_tracker.h"

namespace mantle::controller {
namespace {

class MpcController : public Controller {
 public:
  explicit MpcController(const ControllerParts& parts)
      : parts_(parts),
        mpc_(parts.model, parts.step, parts.options, parts.reference),
        tracker_(parts.model, parts.options),
        parting_(parts.model),
        limits_(parts.options.motors),
        expected_(InitialState(parts.model)),
        start_(expected_),
        held_(VectorX::Zero(parts.model.input_count())) {
    committed_from_ = held_;
  }

  void Start(const ReducedState& state) override {
    mpc_.Start(state);
    mpc_.propagator().SetDisturbance(Disturbance(parts_.model.input_count()));
    prepared_s_ = kNever_s;
    first_ = true;
    issued_.gives_up = false;
    issued_.answered_s = kNever_s;
    HandOver();
  }

  // About what the last plan expects.
  void Prepare(double t_s, const Eigen::Ref<const VectorX>& tensions) override {
    if (!first_) PrepareAbout(nullptr, t_s, tensions);
  }

  void Update(double t_s, const ReducedState* estimate, const Eigen::Ref<const VectorX>& tensions,
              std::int64_t deadline_ns) override {
    const double delay = parts_.options.delay_s, at = t_s + delay;
    double prepared_here_s = 0;
    if (prepared_s_ != t_s) {
      PrepareAbout(first_ ? estimate : nullptr, t_s, tensions);
      prepared_here_s = mpc_.status().prepare_s;
    }
    prepared_s_ = kNever_s;
    // Where the state will be when the plan begins to act.
    start_ = expected_;
    if (estimate == nullptr) {
      start_.q.setConstant(std::numeric_limits<double>::quiet_NaN());
    } else if (delay > 0) {
      held_ = 0.5 * (planned_from_ + tensions);
      const reduced::StepOutcome outcome =
          mpc_.propagator().Step(*estimate, delay, held_, &start_, nullptr);
      if (!outcome.ok) start_ = *estimate;
      start_.time_s = at;
    } else {
      start_ = *estimate;
    }
    if (estimate != nullptr) mpc_.RecordPosition(t_s, estimate->root.position);
    if (IsFinite(start_) && (!mpc_.prepared() || parting_.Apart(expected_, start_))) {
      prepared_here_s -= mpc_.status().prepare_s;
      mpc_.Restart(start_, planned_from_);
      prepared_here_s += mpc_.status().prepare_s;
    }
    // The deadline is the solver's: else one that is slow to prepare would never have a first plan.
    const auto later_ns = static_cast<std::int64_t>(1e9 * prepared_here_s);
    mpc_.Solve(start_, deadline_ns == 0 ? 0 : deadline_ns + later_ns);
    if (mpc_.status().outcome <= Outcome::kStoppedBetter) first_ = false;
    const bool safe = mpc_.status().outcome == Outcome::kSafe;
    if (!safe || !issued_.gives_up) {  // a decay goes on from where it began
      issued_.tensions_n = tensions;
      issued_.issued_s = t_s;
    }
    issued_.gives_up = safe;
    issued_.answered_s = t_s;
    HandOver();
  }

  void SetDisturbance(const Disturbance& disturbance) override {
    mpc_.propagator().SetDisturbance(disturbance);
  }

  void SetLimits(const std::vector<MotorLimits>& limits) override {
    limits_ = limits;
    mpc_.SetLimits(limits);
  }

  void Command(double t_s, const ReducedState* estimate, Eigen::Ref<VectorX> tensions) override {
    commitments_.Take();
    buffer_.Take();
    const IssuedPlan& issued = buffer_.current();
    if (Commits(issued, t_s, tensions)) return;
    tracker_.Command(issued, t_s, estimate, tensions);
  }

  const Mpc* mpc() const override { return &mpc_; }
  bool plans_apart() const override { return true; }

 private:
  static constexpr double kNoTime_s = 1e-9;
  static constexpr double kNever_s = -std::numeric_limits<double>::infinity();

  void PrepareAbout(const ReducedState* estimate, double t_s,
                    const Eigen::Ref<const VectorX>& tensions) {
    const double delay = parts_.options.delay_s, at = t_s + delay;
    if (estimate != nullptr) {
      expected_ = *estimate;
    } else {
      StateAt(mpc_.plan(), at, &expected_);
    }
    expected_.time_s = at;
    TensionsAt(mpc_.plan(), at, held_);
    if (first_) held_ = tensions;
    LimitTensions(limits_, tensions, std::max(delay, kNoTime_s), held_);
    commitment_.from_s = t_s;
    commitment_.until_s = at;
    commitment_.tensions_n = held_;
    commitments_.Publish(commitment_);
    mpc_.Prepare(expected_, held_);
    planned_from_ = held_;
    prepared_s_ = t_s;
  }

  // From the fast loop: while a plan is under way, what it will begin with. So a command does not
  // depend on how soon a plan comes that is there when it begins.
  bool Commits(const IssuedPlan& issued, double t_s, Eigen::Ref<VectorX> tensions) {
    const Commitment& next = commitments_.current();
    const bool under_way = next.tensions_n.size() > 0 && issued.answered_s < next.from_s;
    if (!under_way || issued.gives_up || t_s <= next.from_s || t_s > next.until_s + kNoTime_s) {
      return false;
    }
    if (committed_s_ != next.from_s) {
      committed_s_ = next.from_s;
      committed_from_ = tensions;
    }
    if (t_s >= next.until_s) {
      tensions = next.tensions_n;
    } else {
      const double share = (t_s - next.from_s) / (next.until_s - next.from_s);
      tensions = committed_from_ + share * (next.tensions_n - committed_from_);
    }
    return true;
  }

  void HandOver() {
    issued_.plan = mpc_.plan();
    buffer_.Publish(issued_);
  }

  ControllerParts parts_;
  // The planner.
  Mpc mpc_;
  IssuedPlan issued_;
  Commitment commitment_;
  PlanBuffer buffer_;
  Exchange<Commitment> commitments_;
  // The fast loop.
  PlanTracker tracker_;
  VectorX committed_from_;
  double committed_s_{kNever_s};
  // The planner.
  Parting parting_;
  std::vector<MotorLimits> limits_;
  ReducedState expected_, start_;
  VectorX held_, planned_from_;
  double prepared_s_{kNever_s};
  bool first_{true};
};

}  // namespace

std::unique_ptr<Controller> MakeMpcController(const ControllerParts& parts) {
  return std::make_unique<MpcController>(parts);
}

}  // namespace mantle::controller
