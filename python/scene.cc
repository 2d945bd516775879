#include "python/scene.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "python/arrays.h"
#include "python/bindings.h"

namespace mantle::python {

void DemandTime(const LoadedScene& loaded, const char* who) {
  if (loaded.scene.has_time) return;
  throw scene::BadScene(fmt::format(
      "{}: time: table is missing: {} needs [time] with `duration` > 0 s", loaded.file, who));
}

void BindScene(py::module_& m) {
  py::class_<LoadedScene>(m, "Scene", R"(A scene file that was read and checked (docs/scene.md).)")
      .def(py::init<const std::string&, const std::vector<std::string>&>(), py::arg("file"),
           py::arg("overrides") = std::vector<std::string>{})
      .def_property_readonly("file", [](const LoadedScene& s) { return s.file; })
      .def_property_readonly("overrides", [](const LoadedScene& s) { return s.overrides; })
      .def_property_readonly("name", [](const LoadedScene& s) { return s.scene.name; })
      .def_property_readonly("description",
                             [](const LoadedScene& s) { return s.scene.description; })
      .def_property_readonly("text", [](const LoadedScene& s) { return s.scene.text; })
      .def_property_readonly(
          "fingerprint",
          [](const LoadedScene& s) { return fmt::format("{:016x}", s.scene.fingerprint); })
      .def_property_readonly("duration_s",
                             [](const LoadedScene& s) -> py::object {
                               if (!s.scene.has_time) return py::none();
                               return py::float_(s.scene.run.duration_s);
                             })
      .def_property_readonly("output_interval_s",
                             [](const LoadedScene& s) { return s.scene.run.output_interval_s; })
      .def_property_readonly("has_control",
                             [](const LoadedScene& s) { return s.scene.control.has_value(); })
      .def_property_readonly("motors",
                             [](const LoadedScene& s) {
                               std::vector<std::string> names;
                               for (const auto& motor : s.scene.reduction.actuators) {
                                 names.push_back(motor.name);
                               }
                               return names;
                             })
      .def_property_readonly("tension_limits",
                             [](const LoadedScene& s) -> py::object {
                               if (!s.scene.control) return py::none();
                               const auto& motors = s.scene.control->motors;
                               Eigen::VectorXd low(static_cast<Eigen::Index>(motors.size()));
                               Eigen::VectorXd high = low;
                               for (Eigen::Index i = 0; i < low.size(); ++i) {
                                 low(i) = motors[static_cast<std::size_t>(i)].min_tension_n;
                                 high(i) = motors[static_cast<std::size_t>(i)].max_tension_n;
                               }
                               return py::make_tuple(Copy(low), Copy(high));
                             })
      .def("__reduce__",
           [](const py::object& self) {
             const auto& s = self.cast<const LoadedScene&>();
             return py::make_tuple(self.attr("__class__"), py::make_tuple(s.file, s.overrides));
           })
      .def("__repr__", [](const LoadedScene& s) {
        return fmt::format("<mantle.Scene \"{}\" of {}>", s.scene.name, s.file);
      });
}

}  // namespace mantle::python
