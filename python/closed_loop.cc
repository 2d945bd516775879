#include "loop/closed_loop.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <vector>

#include "python/arrays.h"
#include "python/bindings.h"
#include "python/reduced_state.h"
#include "python/scene.h"
#include "python/user_parts.h"
#include "tools/mantle/control_summary.h"
#include "tools/mantle/trajectory.h"

namespace mantle::python {
namespace {

constexpr double kSameTime_s = 1e-9;

py::object StepObject(const loop::LoopStep& step) {
  using namespace py::literals;
  return py::module_::import("mantle.parts")
      .attr("LoopStep")(
          "time_s"_a = step.time_s, "planned"_a = step.planned, "truth"_a = StateObject(step.truth),
          "estimate"_a = StateObject(step.estimate), "command_n"_a = Copy(step.command_n),
          "tension_n"_a = Copy(step.tension_n), "cost"_a = step.cost, "error"_a = step.error);
}

/// The rows of a run's trajectory as `mantle run` writes them: the plant's columns, then every
/// motor's commanded and actual tension, and the error.
class Trajectory {
 public:
  Trajectory(const scene::Scene& scene, const model::Plant& plant) : scene_(scene), plant_(plant) {
    text_ = tools::TrajectoryTitles(plant);
    text_.pop_back();
    for (const reduced::Actuator& motor : scene.reduction.actuators) {
      text_ += fmt::format(",command_{0}_n,actual_{0}_n", motor.name);
    }
    text_ += ",error\n";
  }

  void Add(const loop::LoopStep& step, loop::PlantSide& plant) {
    const bool at_end = step.time_s >= scene_.run.duration_s - kSameTime_s;
    if (step.time_s < next_s_ - kSameTime_s && !at_end) return;
    const double interval = scene_.run.output_interval_s;
    next_s_ = (std::floor(step.time_s / interval + kSameTime_s) + 1.0) * interval;
    const model::Sample sample = plant.Observe();
    if (plant_.shell) volume_.Add(sample.volume_m3);
    text_ += tools::TrajectoryRow(plant_, sample);
    text_.pop_back();
    for (Eigen::Index i = 0; i < step.command_n.size(); ++i) {
      text_ += fmt::format(",{},{}", step.command_n(i), step.tension_n(i));
    }
    text_ += fmt::format(",{}\n", step.error);
  }

  const std::string& text() const { return text_; }
  const tools::VolumeRange& volume() const { return volume_; }

 private:
  const scene::Scene& scene_;
  const model::Plant& plant_;
  std::string text_;
  double next_s_{0};
  tools::VolumeRange volume_;
};

/// What a run has come to, as texts that Python reads.
struct LoopOutcome {
  std::string summary, trajectory, reason;
  bool complete{false};
};

LoopOutcome RunLoop(const LoadedScene& loaded, const loop::ClosedLoopOptions& options,
                    Session& session, const py::object& observer) {
  LoopOutcome out;
  const auto loop =
      InScene(loaded, [&] { return std::make_unique<loop::ClosedLoop>(loaded.scene, options); });
  Trajectory trajectory(loaded.scene, loop->plant());
  bool stopped = false;
  const loop::LoopResult result = loop->Run([&](const loop::LoopStep& step) {
    trajectory.Add(step, loop->plant_side());
    if (!observer.is_none()) {
      InPython(session, [&] { stopped = observer(StepObject(step)).is(py::bool_(false)); });
    }
    return !stopped && !session.Interrupted();
  });
  if (session.failed()) return out;
  const bool whole = result.time_s >= loaded.scene.run.duration_s - kSameTime_s;
  out.complete = result.ok && whole && result.ended.empty();
  out.reason = !result.ok ? result.reason : !whole ? "stopped by its observer" : result.ended;
  tools::Json summary =
      tools::RunSummary({&loaded.scene, &loop->plant(), &result.plant, trajectory.volume(),
                         loaded.overrides, result.wall_s, result.time_s, out.complete, out.reason});
  summary["control"] = tools::ControlSummary(
      {&loaded.scene, loop.get(), &result,
       options.controller.value_or(loaded.scene.control->controller),
       options.bus.value_or(loaded.scene.drives.bus), options.real_time, false});
  out.summary = tools::Dump(summary);
  out.trajectory = trajectory.text();
  return out;
}

py::tuple Run(const LoadedScene& loaded, const py::object& observer, const std::string& controller,
              const std::string& bus, bool real_time, const py::object& make_controller,
              const py::object& make_estimator) {
  Session session(UserController(make_controller), UserEstimator(make_estimator));
  loop::ClosedLoopOptions options;
  options.real_time = real_time;
  if (!controller.empty()) options.controller = controller;
  if (!bus.empty()) options.bus = bus;
  LoopOutcome out;
  {
    const py::gil_scoped_release running;
    try {
      out = RunLoop(loaded, options, session, observer);
    } catch (const std::exception&) {
      if (!session.failed()) throw;
    }
  }
  session.Rethrow();
  return py::make_tuple(py::bytes(out.summary), out.trajectory, out.complete, out.reason);
}

}  // namespace

void BindClosedLoop(py::module_& m) {
  m.def("run_loop", Run, py::arg("scene"), py::arg("observer"), py::arg("controller"),
        py::arg("bus"), py::arg("real_time"), py::arg("make_controller"),
        py::arg("make_estimator"));
}

}  // namespace mantle::python
