#include "loop/control_side/planner.h"

#include <chrono>

#include "loop/timing.h"

namespace mantle::loop {
namespace {

constexpr std::size_t kMostOrders = 16;
constexpr std::size_t kMostReports = 64;

std::int64_t Now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Planner::Planner(controller::Controller& controller, double deadline_s,
                 const reduced::ReducedState& start,
                 const std::vector<controller::MotorLimits>& motors)
    : controller_(controller),
      deadline_s_(deadline_s),
      next_{Kind::kStart,
            0,
            0,
            start,
            model::VectorX::Zero(static_cast<Eigen::Index>(motors.size())),
            controller::Disturbance(static_cast<int>(motors.size())),
            motors,
            false},
      orders_(kMostOrders, next_),
      reports_(kMostReports),
      order_(next_) {
  thread_ = std::thread([this] { Run(); });
}

Planner::~Planner() { Stop(); }

void Planner::Stop() {
  if (!thread_.joinable()) return;
  stopping_.store(true, std::memory_order_release);
  waiting_.release();
  thread_.join();
  counters_.refused = refused_.load(std::memory_order_relaxed);
}

void Planner::Post() {
  if (!orders_.Push(next_)) {
    refused_.fetch_add(1, std::memory_order_relaxed);
    return;  // the limits go with the next one
  }
  next_.has_limits = false;
  waiting_.release();
}

void Planner::PostStart(const reduced::ReducedState& state) {
  answered_.store(-1, std::memory_order_release);
  next_.kind = Kind::kStart;
  next_.state = state;
  Post();
}

void Planner::PostPrepare(double t_s, const Eigen::Ref<const model::VectorX>& tensions,
                          const controller::Disturbance& disturbance) {
  next_.kind = Kind::kPrepare;
  next_.t_s = t_s;
  next_.tensions_n = tensions;
  next_.disturbance = disturbance;
  Post();
}

void Planner::PostUpdate(long cycle, double t_s, const reduced::ReducedState& estimate,
                         const Eigen::Ref<const model::VectorX>& tensions) {
  next_.kind = Kind::kUpdate;
  next_.cycle = cycle;
  next_.t_s = t_s;
  next_.state = estimate;
  next_.tensions_n = tensions;
  Post();
}

void Planner::SetLimits(const std::vector<controller::MotorLimits>& limits) {
  next_.limits = limits;
  next_.has_limits = true;
}

void Planner::Run() {
  RunAtOnce(kPlannerPriority);
  for (;;) {
    waiting_.acquire();
    if (stopping_.load(std::memory_order_acquire)) return;
    if (!orders_.Pop(&order_)) continue;
    // Of what waits, the newest; a start and new limits are never passed over.
    while (order_.kind != Kind::kStart && orders_.Front() != nullptr &&
           orders_.Front()->kind != Kind::kStart) {
      if (order_.has_limits) controller_.SetLimits(order_.limits);
      if (order_.kind == Kind::kUpdate) ++counters_.overtaken;
      orders_.Pop(&order_);
    }
    Do(order_);
  }
}

void Planner::Do(const Order& order) {
  if (order.has_limits) controller_.SetLimits(order.limits);
  switch (order.kind) {
    case Kind::kStart:
      controller_.Start(order.state);
      answered_.store(-1, std::memory_order_release);  // whatever was under way
      break;
    case Kind::kPrepare:
      controller_.SetDisturbance(order.disturbance);
      controller_.Prepare(order.t_s, order.tensions_n);
      break;
    case Kind::kUpdate: {
      const auto deadline_ns = Now_ns() + static_cast<std::int64_t>(1e9 * deadline_s_);
      controller_.Update(order.t_s, &order.state, order.tensions_n, deadline_ns);
      answered_.store(order.cycle, std::memory_order_release);
      ++counters_.jobs;
      Report(order);
      break;
    }
  }
}

void Planner::Report(const Order& order) {
  const controller::Mpc* mpc = controller_.mpc();
  if (mpc == nullptr) return;
  counters_.prepare_s.push_back(mpc->status().prepare_s);
  counters_.solve_s.push_back(mpc->status().solve_s);
  counters_.iterations += mpc->status().iterations;
  report_.time_s = order.t_s;
  report_.plan = mpc->plan();
  report_.status = mpc->status();
  report_.counters = mpc->counters();
  report_.iterations = counters_.iterations;
  if (!reports_.Push(report_)) ++counters_.unheard;
}

}  // namespace mantle::loop
