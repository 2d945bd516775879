#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "python/scene.h"
#include "reduced/reduced_model.h"

namespace mantle::python {

/// What an environment sees at the beginning of a control period.
struct EpisodeView {
  double time_s{0};
  reduced::ReducedState estimate, truth;
  Eigen::VectorXd tension_n;  ///< actual, one per motor
  double cost{0};             ///< of the scene, from t = 0 to now
  double error{0};            ///< loop/closed_loop.h, LoopStep::error
  bool over{false};           ///< the run has ended
  bool complete{false};       ///< and came to its end
  std::string reason;         ///< why it did not
};

/// A closed loop that stops at every control period, to be told the tensions of the next: drives,
/// sensors and estimator of the scene, with what it is told as its controller. It runs in a thread
/// of its own, and never while it is being looked at: between two calls of a member it waits. The
/// tensions act from the SYNC after the one they are given at, as a plan's do (control.delay).
class Episode {
 public:
  /// The first view is at t = 0. Throws as ClosedLoop.
  explicit Episode(const LoadedScene& scene);
  /// Ends the run in order. Not to be called where it is forked().
  ~Episode();
  Episode(const Episode&) = delete;
  Episode& operator=(const Episode&) = delete;

  /// The run goes on with these tensions. Throws tools::BadInput where it is over, or forked().
  void Act(const Eigen::VectorXd& tensions_n);
  /// Whether it has come to its next control period, or its end; waits that long at most. Throws
  /// what ended it, where that is none of a run's own reasons.
  bool Wait(double patience_s);
  /// After Wait.
  const EpisodeView& view() const { return view_; }
  int motors() const { return motors_; }
  /// Whether the process is a fork of the one that began it: then nothing runs here.
  bool forked() const;

 private:
  class Held;
  void Run();
  bool Observe(const EpisodeView& view);

  LoadedScene scene_;
  int motors_{0}, process_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool waiting_{false}, ending_{false};  ///< for an action; for the destructor
  Eigen::VectorXd tensions_n_;
  EpisodeView view_;
  std::exception_ptr refused_;
  std::thread thread_;
};

}  // namespace mantle::python
