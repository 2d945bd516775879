#include "model/simulation.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>

#include "python/arrays.h"
#include "python/bindings.h"
#include "python/body_shape.h"
#include "python/scene.h"
#include "reduced/reduction.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/trajectory.h"

namespace mantle::python {
namespace {

constexpr double kSameTime_s = 1e-9;

// Names of the cables as motors' targets have them, ARM.CABLE and MANTLE.SPOKES.
std::vector<std::string> CableNamesOf(const model::Plant& plant) {
  std::vector<std::string> names;
  for (const model::Rod& rod : plant.rods) {
    for (const model::RodCable& cable : rod.cables) names.push_back(rod.name + "." + cable.name);
  }
  if (plant.shell) {
    for (const auto& spokes : plant.shell->spokes) {
      names.push_back(plant.shell->name + "." + spokes.strip.name);
    }
  }
  return names;
}

/// The plant of a scene in time, stepped by hand.
class HandRun {
 public:
  explicit HandRun(const LoadedScene& loaded)
      : loaded_(loaded),
        plant_(InScene(loaded, [&] { return model::Plant(loaded.scene.robot); })),
        cables_(CableNamesOf(plant_)),
        tensions_(
            Eigen::VectorXd::Constant(static_cast<Eigen::Index>(cables_.size()), std::nan(""))),
        shape_(plant_) {
    DemandTime(loaded_, "mantle.Simulation");
    simulation_ = InScene(
        loaded_, [&] { return std::make_unique<model::Simulation>(plant_, loaded_.scene.run); });
    shape_.Set(plant_, simulation_->state());
  }

  const scene::Scene& scene() const { return loaded_.scene; }
  const model::Plant& plant() const { return plant_; }
  const std::vector<std::string>& cables() const { return cables_; }
  double time_s() { return shape_.time_s; }
  BodyShape& shape() { return shape_; }

  // As `mantle run` goes: by way of its samples, so that the bits are the same.
  void AdvanceTo(double t_s) {
    const std::unique_lock<std::mutex> alone = Alone();
    if (!std::isfinite(t_s)) {
      throw tools::BadInput(fmt::format("advance_to: {} s: must be finite", t_s));
    }
    if (t_s < simulation_->time_s() - kSameTime_s) {
      throw tools::BadInput(fmt::format("advance_to: {} s: must be at or after {} s, where it is",
                                        t_s, simulation_->time_s()));
    }
    while (simulation_->time_s() < t_s - kSameTime_s) {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      const double interval = loaded_.scene.run.output_interval_s;
      const double due = (std::floor(simulation_->time_s() / interval + 1e-9) + 1.0) * interval;
      model::StepStatus status;
      {
        const py::gil_scoped_release running;
        status = simulation_->AdvanceTo(std::min(due, t_s));
      }
      shape_.Set(plant_, simulation_->state());
      if (!status.ok) {
        throw tools::CannotGoOn(fmt::format("{}: {}", loaded_.scene.name, status.reason));
      }
    }
  }

  void SetTension(const std::string& cable, std::optional<double> tension_n) {
    const std::unique_lock<std::mutex> alone = Alone();
    const Eigen::Index i = reduced::FindCable(plant_.robot, cable);
    if (!tension_n) {
      tensions_(i) = std::nan("");
      return;
    }
    if (loaded_.scene.run.stepper.integrator == model::Integrator::kCvode) {
      throw tools::BadInput(
          "set_tension: needs another integrator than cvode, whose history takes no jump");
    }
    const double n = *tension_n;
    if (!(std::isfinite(n) && n >= 0)) {
      throw tools::BadInput(
          fmt::format("set_tension: {}: {} N: must be finite and >= 0", cable, n));
    }
    TakeHands();
    tensions_(i) = n;
  }

  py::dict Observe() {
    const std::unique_lock<std::mutex> alone = Alone();
    return Named(tools::TrajectoryTitles(plant_),
                 tools::TrajectoryRow(plant_, simulation_->Observe()));
  }

  std::string Checkpoint() {
    const std::unique_lock<std::mutex> alone = Alone();
    return simulation_->Checkpoint();
  }

  void Restore(const std::string& checkpoint) {
    const std::unique_lock<std::mutex> alone = Alone();
    simulation_->Restore(checkpoint);
    shape_.Set(plant_, simulation_->state());
  }

 private:
  // From the first tension that is given by hand on: steps then know that inputs may jump.
  void TakeHands() {
    if (loaded_.scene.run.stepper.input_hook) return;
    const std::string here = simulation_->Checkpoint();
    model::RunSettings run = loaded_.scene.run;
    run.stepper.input_hook = [this](double, bool, model::PlantInputs* inputs) {
      for (Eigen::Index k = 0; k < tensions_.size(); ++k) {
        if (std::isnan(tensions_(k))) continue;
        model::CableInput& cable = inputs->cables[static_cast<std::size_t>(k)];
        cable.reeled = false;
        cable.tension_n = tensions_(k);
      }
    };
    auto steered = std::make_unique<model::Simulation>(plant_, run);
    steered->Restore(here);
    simulation_ = std::move(steered);
    loaded_.scene.run = run;
  }

  // Another thread has it while it advances.
  std::unique_lock<std::mutex> Alone() {
    std::unique_lock alone(busy_, std::try_to_lock);
    if (!alone) throw tools::BadInput("this simulation is advancing in another thread");
    return alone;
  }

  static py::dict Named(std::string_view titles, std::string_view row) {
    py::dict named;
    const auto next = [](std::string_view* rest) {
      const std::size_t end = rest->find_first_of(",\n");
      const std::string_view cell = rest->substr(0, end);
      rest->remove_prefix(end == rest->npos ? rest->size() : end + 1);
      return cell;
    };
    while (!titles.empty()) {
      const std::string_view title = next(&titles), cell = next(&row);
      named[py::str(std::string(title))] = py::float_(py::str(std::string(cell)));
    }
    return named;
  }

  LoadedScene loaded_;
  model::Plant plant_;
  std::vector<std::string> cables_;
  Eigen::VectorXd tensions_;  ///< NaN: as the scene has it
  BodyShape shape_;
  std::unique_ptr<model::Simulation> simulation_;
  std::mutex busy_;
};

}  // namespace

void BindSimulation(py::module_& m) {
  py::class_<HandRun>(m, "Simulation")
      .def(py::init<const LoadedScene&>(), py::arg("scene"))
      .def_property_readonly("time_s", &HandRun::time_s)
      .def_property_readonly("duration_s",
                             [](const HandRun& s) { return s.scene().run.duration_s; })
      .def_property_readonly("output_interval_s",
                             [](const HandRun& s) { return s.scene().run.output_interval_s; })
      .def_property_readonly("body_length_m",
                             [](const HandRun& s) { return s.plant().body_length_m; })
      .def_property_readonly("unknowns", [](const HandRun& s) { return s.plant().velocity_size(); })
      .def_property_readonly("cables", &HandRun::cables)
      .def_property_readonly("shape", &HandRun::shape, py::return_value_policy::reference_internal)
      .def("advance_to", &HandRun::AdvanceTo, py::arg("time_s"))
      .def("set_tension", &HandRun::SetTension, py::arg("cable"), py::arg("tension_n"))
      .def("observe", &HandRun::Observe)
      .def("checkpoint", &HandRun::Checkpoint)
      .def("restore", &HandRun::Restore, py::arg("checkpoint"))
      .def("__repr__", [](HandRun& s) {
        return fmt::format("<mantle.Simulation of \"{}\" at t = {:.6g} s>", s.scene().name,
                           s.time_s());
      });
}

}  // namespace mantle::python
