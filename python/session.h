#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "controller/controller.h"
#include "controller/estimator.h"

namespace mantle::python {

namespace py = pybind11;

/// One run that a thread of Python has begun: what it uses of Python while the interpreter is
/// released, and what happened there. While it lives it is its thread's current one; a thread has
/// one at a time.
class Session {
 public:
  using MakeController =
      std::function<std::unique_ptr<controller::Controller>(const controller::ControllerParts&)>;
  using MakeEstimator =
      std::function<std::unique_ptr<controller::Estimator>(const controller::EstimatorParts&)>;

  /// What the run's names "python" stand for; empty: nothing. Throws tools::BadInput where the
  /// thread has a session already.
  explicit Session(MakeController make_controller = {}, MakeEstimator make_estimator = {});
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Of the calling thread; null where it has none.
  static Session* Current();
  /// Sessions of all threads.
  static int Count();

  const MakeController& make_controller() const { return make_controller_; }
  const MakeEstimator& make_estimator() const { return make_estimator_; }

  /// Whether the run is to end: an exception was kept, or a signal's handler (looked at every 20 ms, in
  /// the main thread alone) raised one, which is kept. Takes the interpreter for that alone.
  bool Interrupted();
  /// Keeps the first exception that Python code of the run raised. With the interpreter held.
  void Keep(py::error_already_set& error);
  bool failed() const { return failed_; }
  /// Raises what was kept. With the interpreter held.
  void Rethrow();

 private:
  MakeController make_controller_;
  MakeEstimator make_estimator_;
  std::atomic<bool> failed_{false};
  std::optional<py::error_already_set> error_;
  std::chrono::steady_clock::time_point looked_{std::chrono::steady_clock::now()};
};

/// Registers the controller "python" and the estimator "python": what the current session makes.
void RegisterUserTypes();

}  // namespace mantle::python
