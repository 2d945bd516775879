#include "python/body_shape.h"

#include <fmt/format.h>

#include "python/arrays.h"
#include "python/bindings.h"
#include "tools/mantle/bad_input.h"

namespace mantle::python {
namespace {

Eigen::Vector4d Wxyz(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// As the earth sees it what moves with `twist` in water of velocity c.
model::Vector6 InEarth(const model::Vector6& twist, const Eigen::Quaterniond& rotation,
                       const Eigen::Vector3d& c) {
  model::Vector6 earth = twist;
  earth.tail<3>() += rotation.conjugate() * c;
  return earth;
}

}  // namespace

BodyShape::BodyShape(const model::Plant& plant) {
  for (const model::Rod& rod : plant.rods) {
    Arm& arm = arms.emplace_back();
    const int elements = rod.element_count();
    arm.name = rod.name;
    arm.arc_length_m = Eigen::Map<const Eigen::VectorXd>(rod.x_m.data(), elements + 1);
    arm.position_m.setZero(3, elements + 1);
    arm.quaternion_wxyz.setZero(4, elements + 1);
    arm.twist.setZero(6, elements + 1);
    arm.strain.setZero(6, elements);
    arm.stress.setZero(6, elements);
  }
  if (!plant.shell) return;
  Mantle& m = mantle.emplace_back();
  const int elements = plant.shell->element_count();
  m.name = plant.shell->name;
  m.arc_length_m.resize(elements + 1);
  for (int j = 0; j <= elements; ++j) {
    m.arc_length_m(j) = plant.shell->nodes[static_cast<std::size_t>(j)].x_m;
  }
  m.profile.setZero(3, elements + 1);
  m.profile_rate.setZero(3, elements + 1);
  m.strain.setZero(5, elements);
}

void BodyShape::Set(const model::Plant& plant, const model::PlantState& state) {
  const model::WaterMotion water = EvaluateWater(plant.robot.effects, state.time_s);
  time_s = state.time_s;
  root_position_m = state.pose[0].position + water.drift_m;
  root_quaternion_wxyz = Wxyz(state.pose[0].rotation);
  root_twist = InEarth(state.velocity.head<6>(), state.pose[0].rotation, water.velocity_m_s);
  for (int a = 0; a < static_cast<int>(arms.size()); ++a) {
    Arm& arm = arms[static_cast<std::size_t>(a)];
    const model::Rod& rod = plant.rods[static_cast<std::size_t>(a)];
    model::Pose before;
    model::Vector6 twist_before;
    for (int i = 0; i <= rod.element_count(); ++i) {
      const model::Pose g = AbsolutePose(plant, state, a, i);
      const model::Vector6 twist = AbsoluteTwist(plant, state, a, i);
      arm.position_m.col(i) = g.position + water.drift_m;
      arm.quaternion_wxyz.col(i) = Wxyz(g.rotation);
      arm.twist.col(i) = InEarth(twist, g.rotation, water.velocity_m_s);
      if (i > 0) {
        const model::RodElement& element = rod.elements[static_cast<std::size_t>(i - 1)];
        model::RodElementState s;
        if (!EvaluateRodElement(before, g, twist_before, twist, &s)) {
          throw tools::CannotGoOn(
              fmt::format("{}: element {} turns too far to have a strain", rod.name, i - 1));
        }
        arm.strain.col(i - 1) = s.Strain(element);
        arm.stress.col(i - 1) = RodStress(element, s);
      }
      before = g;
      twist_before = twist;
    }
  }
  if (mantle.empty()) return;
  Mantle& m = mantle.front();
  const model::Shell& shell = *plant.shell;
  for (int j = 0; j <= shell.element_count(); ++j) {
    const auto node = static_cast<std::size_t>(j);
    m.profile.col(j) = state.shape[node];
    m.profile_rate.col(j) = state.velocity.segment<3>(plant.ShellVelocity(j));
    if (j == 0) continue;
    model::ShellElementState s;
    EvaluateShellElement(shell.elements[node - 1], shell.material, state.shape[node - 1],
                         state.shape[node], m.profile_rate.col(j - 1), m.profile_rate.col(j), &s);
    m.strain.col(j - 1) = s.strain;
  }
}

void BindShape(py::module_& m) {
  using Arm = BodyShape::Arm;
  using Mantle = BodyShape::Mantle;
  const auto rows = [](auto member) {
    return [member](const py::object& self) {
      return RowsView(self.cast<const Arm&>().*member, self);
    };
  };
  py::class_<Arm>(m, "ArmShape")
      .def_readonly("name", &Arm::name)
      .def_property_readonly("arc_length_m",
                             [](const py::object& self) {
                               const auto& x = self.cast<const Arm&>().arc_length_m;
                               return View(x.data(), {x.size()}, self);
                             })
      .def_property_readonly("position_m", rows(&Arm::position_m))
      .def_property_readonly("quaternion_wxyz", rows(&Arm::quaternion_wxyz))
      .def_property_readonly("twist", rows(&Arm::twist))
      .def_property_readonly("strain", rows(&Arm::strain))
      .def_property_readonly("stress", rows(&Arm::stress));
  py::class_<Mantle>(m, "MantleShape")
      .def_readonly("name", &Mantle::name)
      .def_property_readonly("arc_length_m",
                             [](const py::object& self) {
                               const auto& x = self.cast<const Mantle&>().arc_length_m;
                               return View(x.data(), {x.size()}, self);
                             })
      .def_property_readonly(
          "profile",
          [](const py::object& self) { return RowsView(self.cast<const Mantle&>().profile, self); })
      .def_property_readonly("profile_rate",
                             [](const py::object& self) {
                               return RowsView(self.cast<const Mantle&>().profile_rate, self);
                             })
      .def_property_readonly("strain", [](const py::object& self) {
        return RowsView(self.cast<const Mantle&>().strain, self);
      });
  py::class_<BodyShape>(m, "Shape")
      .def_readonly("time_s", &BodyShape::time_s)
      .def_property_readonly("root_position_m",
                             [](const py::object& self) {
                               const auto& s = self.cast<const BodyShape&>();
                               return View(s.root_position_m.data(), {3}, self);
                             })
      .def_property_readonly("root_quaternion_wxyz",
                             [](const py::object& self) {
                               const auto& s = self.cast<const BodyShape&>();
                               return View(s.root_quaternion_wxyz.data(), {4}, self);
                             })
      .def_property_readonly("root_twist",
                             [](const py::object& self) {
                               const auto& s = self.cast<const BodyShape&>();
                               return View(s.root_twist.data(), {6}, self);
                             })
      .def_property_readonly("arms",
                             [](const py::object& self) {
                               auto& s = self.cast<BodyShape&>();
                               py::dict arms;
                               for (Arm& arm : s.arms) {
                                 arms[py::str(arm.name)] = py::cast(
                                     arm, py::return_value_policy::reference_internal, self);
                               }
                               return arms;
                             })
      .def_property_readonly("mantle", [](const py::object& self) -> py::object {
        auto& s = self.cast<BodyShape&>();
        if (s.mantle.empty()) return py::none();
        return py::cast(s.mantle.front(), py::return_value_policy::reference_internal, self);
      });
}

}  // namespace mantle::python
