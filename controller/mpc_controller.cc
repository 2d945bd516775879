#include <algorithm>
#include <limits>

#include "controller/controller.h"
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
        held_(VectorX::Zero(parts.model.input_count())) {}

  void Start(const ReducedState& state) override {
    mpc_.Start(state);
    mpc_.propagator().SetDisturbance(Disturbance(parts_.model.input_count()));
    prepared_s_ = kNever_s;
    first_ = true;
    issued_.gives_up = false;
    HandOver();
  }

  // About what the last plan expects.
  void Prepare(double t_s, const Eigen::Ref<const VectorX>& tensions) override {
    if (!first_) PrepareAbout(nullptr, t_s, tensions);
  }

  void Update(double t_s, const ReducedState* estimate, const Eigen::Ref<const VectorX>& tensions,
              std::int64_t deadline_ns) override {
    const double delay = parts_.options.delay_s, at = t_s + delay;
    if (prepared_s_ != t_s) PrepareAbout(first_ ? estimate : nullptr, t_s, tensions);
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
      mpc_.Restart(start_, planned_from_);
    }
    mpc_.Solve(start_, deadline_ns);
    if (mpc_.status().outcome <= Outcome::kStoppedBetter) first_ = false;
    const bool safe = mpc_.status().outcome == Outcome::kSafe;
    if (!safe || !issued_.gives_up) {  // a decay goes on from where it began
      issued_.tensions_n = tensions;
      issued_.issued_s = t_s;
    }
    issued_.gives_up = safe;
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
    buffer_.Take();
    tracker_.Command(buffer_.current(), t_s, estimate, tensions);
  }

  const Mpc* mpc() const override { return &mpc_; }

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
    mpc_.Prepare(expected_, held_);
    planned_from_ = held_;
    prepared_s_ = t_s;
  }

  void HandOver() {
    issued_.plan = mpc_.plan();
    buffer_.Publish(issued_);
  }

  ControllerParts parts_;
  // The planner.
  Mpc mpc_;
  IssuedPlan issued_;
  PlanBuffer buffer_;
  PlanTracker tracker_;  // the fast loop
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
