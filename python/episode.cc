#include "python/episode.h"

#include <unistd.h>

#include <chrono>
#include <memory>
#include <utility>

#include "loop/closed_loop.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/reduced_state.h"
#include "python/session.h"
#include "tools/mantle/bad_input.h"

namespace mantle::python {

/// The controller that commands what the episode was told.
class Episode::Held final : public controller::Controller {
 public:
  explicit Held(const Eigen::VectorXd& tensions_n) : tensions_n_(tensions_n) {}
  void Command(double, const reduced::ReducedState*, Eigen::Ref<model::VectorX> tensions) override {
    if (tensions_n_.size() == tensions.size()) tensions = tensions_n_;
  }

 private:
  const Eigen::VectorXd& tensions_n_;
};

Episode::Episode(const LoadedScene& scene)
    : scene_(scene),
      motors_(static_cast<int>(scene.scene.reduction.actuators.size())),
      process_(getpid()),
      thread_([this] { Run(); }) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_ || view_.over; });
  if (!refused_) return;
  lock.unlock();
  thread_.join();
  std::rethrow_exception(refused_);
}

Episode::~Episode() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    waiting_ = false;
  }
  changed_.notify_all();
  thread_.join();
}

bool Episode::forked() const { return getpid() != process_; }

void Episode::Run() {
  std::string reason;
  bool complete = false;
  try {
    Session session(
        [this](const controller::ControllerParts&) { return std::make_unique<Held>(tensions_n_); });
    loop::ClosedLoopOptions options;
    options.controller = "python";
    const auto loop =
        InScene(scene_, [&] { return std::make_unique<loop::ClosedLoop>(scene_.scene, options); });
    EpisodeView now;
    const loop::LoopResult result = loop->Run([&](const loop::LoopStep& step) {
      now.time_s = step.time_s;
      now.cost = step.cost;
      now.error = step.error;
      const bool stop_here = step.planned;
      now.estimate = step.estimate;
      now.truth = step.truth;
      now.tension_n = step.tension_n;
      return !stop_here || Observe(now);
    });
    complete = result.ok && result.ended.empty() && !ending_;
    reason = result.ok ? result.ended : result.reason;
    const std::lock_guard lock(mutex_);
    view_ = now;
  } catch (...) {
    refused_ = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  view_.over = true;
  view_.complete = complete;
  view_.reason = reason;
  changed_.notify_all();
}

// In the episode's own thread: shows what it sees, and waits for the next action.
bool Episode::Observe(const EpisodeView& view) {
  std::unique_lock lock(mutex_);
  if (ending_) return false;
  view_ = view;
  waiting_ = true;
  changed_.notify_all();
  changed_.wait(lock, [this] { return !waiting_; });
  return !ending_;
}

void Episode::Act(const Eigen::VectorXd& tensions_n) {
  if (forked()) {
    throw tools::BadInput(
        "this episode runs in the process that was forked from: reset() begins one");
  }
  {
    const std::lock_guard lock(mutex_);
    if (view_.over || !waiting_)
      throw tools::BadInput("this episode is over or moving: reset() begins one");
    tensions_n_ = tensions_n;
    waiting_ = false;
  }
  changed_.notify_all();
}

bool Episode::Wait(double patience_s) {
  std::unique_lock lock(mutex_);
  const bool here = changed_.wait_for(lock, std::chrono::duration<double>(patience_s),
                                      [this] { return waiting_ || view_.over; });
  if (here && refused_) std::rethrow_exception(std::exchange(refused_, nullptr));
  return here;
}

namespace {

// In a process that was forked the episode's thread is not there to be waited for: it stays as it
// is.
struct Ended {
  void operator()(Episode* episode) const {
    if (!episode->forked()) delete episode;
  }
};

}  // namespace

void BindEpisode(py::module_& m) {
  constexpr double kLookEvery_s = 0.05;
  const auto view = [](const Episode& e) {
    const EpisodeView& v = e.view();
    py::dict now;
    now["time_s"] = v.time_s;
    now["estimate"] = StateObject(v.estimate);
    now["truth"] = StateObject(v.truth);
    now["tension_n"] = Copy(v.tension_n);
    now["cost"] = v.cost;
    now["error"] = v.error;
    now["over"] = v.over;
    now["complete"] = v.complete;
    now["reason"] = v.reason;
    return now;
  };
  py::class_<Episode, std::unique_ptr<Episode, Ended>>(m, "Episode")
      .def(py::init([](const LoadedScene& scene) {
             const py::gil_scoped_release running;
             return std::unique_ptr<Episode, Ended>(new Episode(scene));
           }),
           py::arg("scene"))
      .def("view", view)
      .def(
          "act",
          [view](Episode& e, const Numbers& tensions) {
            e.Act(VectorOf("action", tensions, e.motors()));
            for (bool here = false; !here;) {
              if (PyErr_CheckSignals() != 0) throw py::error_already_set();
              const py::gil_scoped_release running;
              here = e.Wait(kLookEvery_s);
            }
            return view(e);
          },
          py::arg("tensions"));
}

}  // namespace mantle::python
