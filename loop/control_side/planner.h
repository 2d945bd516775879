#pragma once

#include <atomic>
#include <cstddef>
#include <semaphore>
#include <thread>
#include <vector>

#include "controller/controller.h"
#include "firmware_sim/bus/spsc_ring.h"

namespace mantle::loop {

/// What a planner has made of a measurement, for whoever listens.
struct PlanReport {
  double time_s{0};  ///< of the measurement
  controller::Plan plan;
  controller::MpcStatus status;
  controller::MpcCounters counters;
  long iterations{0};  ///< of the solver, over all plans
};

/// Figures of a planner; whole when it has stopped.
struct PlannerCounters {
  long jobs{0};        ///< plans made or kept
  long overtaken{0};   ///< measurements that a newer one overtook before they were looked at
  long refused{0};     ///< orders that found the queue full: the planner is stuck
  long unheard{0};     ///< reports that nobody had room for
  long iterations{0};  ///< of the solver, over all plans
  std::vector<double> prepare_s, solve_s;  ///< of every plan, by the wall clock
};

/// The slow half of a controller that plans (Controller::plans_apart) in a thread of its own beside
/// the fast loop, which gives it orders and goes on: no call of Post waits, allocates or takes a
/// lock. Of several measurements that wait the newest is planned for. Plans go to the fast loop by
/// the controller's own wait-free exchange.
class Planner {
 public:
  /// `controller` must outlive it. `deadline_s` of the solver, from when it begins. `start` is a
  /// state of the vehicle's size, `motors` the limits, one per motor.
  Planner(controller::Controller& controller, double deadline_s, const reduced::ReducedState& start,
          const std::vector<controller::MotorLimits>& motors);
  ~Planner();
  Planner(const Planner&) = delete;
  Planner& operator=(const Planner&) = delete;

  // From the fast loop. `cycle` numbers the measurements' SYNCs.

  /// A new run from this state.
  void PostStart(const reduced::ReducedState& state);
  /// What the next Update does not have to wait for (Controller::Prepare).
  void PostPrepare(double t_s, const Eigen::Ref<const model::VectorX>& tensions,
                   const controller::Disturbance& disturbance);
  /// Plan for this measurement.
  void PostUpdate(long cycle, double t_s, const reduced::ReducedState& estimate,
                  const Eigen::Ref<const model::VectorX>& tensions);
  /// Of the next order.
  void SetLimits(const std::vector<controller::MotorLimits>& limits);
  /// Cycle of the newest measurement that a plan answers; -1 before the first of a run.
  long answered() const { return answered_.load(std::memory_order_acquire); }

  // From one other thread.

  /// The oldest report that was not received yet; false where there is none.
  bool Receive(PlanReport* report) { return reports_.Pop(report); }

  /// Finishes what is under way and ends the thread. From then on the controller is the caller's.
  void Stop();
  const PlannerCounters& counters() const { return counters_; }

 private:
  enum class Kind : std::uint8_t { kStart, kPrepare, kUpdate };
  struct Order {
    Kind kind{Kind::kStart};
    long cycle{0};
    double t_s{0};
    reduced::ReducedState state;
    model::VectorX tensions_n;
    controller::Disturbance disturbance;
    std::vector<controller::MotorLimits> limits;
    bool has_limits{false};
  };

  void Post();
  void Run();
  void Do(const Order& order);
  void Report(const Order& order);

  controller::Controller& controller_;
  double deadline_s_;
  Order next_;  ///< of the fast loop
  firmware_sim::SpscRing<Order> orders_;
  firmware_sim::SpscRing<PlanReport> reports_;
  PlanReport report_;
  Order order_;  ///< of the planner
  PlannerCounters counters_;
  std::atomic<long> answered_{-1}, refused_{0};
  std::atomic<bool> stopping_{false};
  std::counting_semaphore<> waiting_{0};
  std::thread thread_;
};

}  // namespace mantle::loop
