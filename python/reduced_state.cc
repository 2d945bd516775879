#include "python/reduced_state.h"

#include <fmt/format.h>

#include <cmath>

#include "python/arrays.h"
#include "python/bindings.h"
#include "reduced/outputs.h"
#include "tools/mantle/bad_input.h"

namespace mantle::python {
namespace {

constexpr double kUnit = 1e-6;  // by which a quaternion's length may miss 1

py::array_t<double> Quaternion(const StateBox& s) {
  const Eigen::Quaterniond& r = s.state.root.rotation;
  return Copy(Eigen::Vector4d(r.w(), r.x(), r.y(), r.z()));
}

void SetQuaternion(StateBox& s, const Numbers& numbers) {
  const Eigen::VectorXd q = VectorOf("root_quaternion_wxyz", numbers, 4);
  if (std::abs(q.norm() - 1.0) > kUnit) {
    throw tools::BadInput(
        fmt::format("root_quaternion_wxyz: has the length {}, must be 1", q.norm()));
  }
  s.state.root.rotation = Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized();
}

}  // namespace

py::object StateObject(const reduced::ReducedState& state) { return py::cast(StateBox{state}); }

const reduced::ReducedState& CheckedState(const std::string& what,
                                          const reduced::ReducedModel& model, const StateBox& box) {
  const std::string complaint = SizeComplaint(model, box.state);
  if (!complaint.empty()) throw tools::BadInput(fmt::format("{}: {}", what, complaint));
  if (!reduced::IsFinite(box.state)) {
    throw tools::BadInput(fmt::format("{}: has a number that is not finite", what));
  }
  return box.state;
}

void BindReducedState(py::module_& m) {
  py::class_<StateBox>(m, "ReducedState")
      .def("copy", [](const StateBox& s) { return StateBox{s.state}; })
      .def("__copy__", [](const StateBox& s) { return StateBox{s.state}; })
      .def("__deepcopy__", [](const StateBox& s, const py::dict&) { return StateBox{s.state}; })
      .def_property(
          "time_s", [](const StateBox& s) { return s.state.time_s; },
          [](StateBox& s, double t) { s.state.time_s = t; })
      .def_property_readonly("root_position_m",
                             [](const py::object& self) {
                               const auto& s = self.cast<const StateBox&>();
                               return View(s.state.root.position.data(), {3}, self, true);
                             })
      .def_property("root_quaternion_wxyz", Quaternion, SetQuaternion)
      .def_property_readonly("q",
                             [](const py::object& self) {
                               const auto& s = self.cast<const StateBox&>();
                               return View(s.state.q.data(), {s.state.q.size()}, self, true);
                             })
      .def_property_readonly("v",
                             [](const py::object& self) {
                               const auto& s = self.cast<const StateBox&>();
                               return View(s.state.v.data(), {s.state.v.size()}, self, true);
                             })
      .def("__repr__", [](const StateBox& s) {
        return fmt::format("<mantle.ReducedState at t = {:.6g} s, {} coordinates>", s.state.time_s,
                           s.state.q.size());
      });
}

}  // namespace mantle::python
