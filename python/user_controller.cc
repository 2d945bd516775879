#include <fmt/format.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>

#include "controller/reference.h"
#include "controller/steering.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/reduced_model.h"
#include "python/reduced_state.h"
#include "python/user_parts.h"
#include "tools/mantle/bad_input.h"

namespace mantle::python {
namespace {

using controller::ControllerParts;
using model::VectorX;

/// The goal of a scene as a controller sees it.
class ReferenceHandle {
 public:
  ReferenceHandle(const ControllerParts& parts, std::shared_ptr<ModelHandle> model)
      : reference_(parts.options.goal, parts.model.robot),
        model_(std::move(model)),
        aim_(std::make_unique<controller::Aim>(parts.model, reference_)) {}

  py::dict At(double t_s) const {
    const controller::ReferencePoint at = reference_.At(t_s);
    py::dict point;
    point["position_m"] = reference_.has_position() ? py::object(Copy(at.position)) : py::none();
    point["direction"] = Copy(at.direction);
    point["velocity_m_s"] = Copy(at.velocity);
    point["tip_m"] = reference_.has_tip() ? py::object(Copy(at.tip)) : py::none();
    return point;
  }

  py::tuple Aim(const StateBox& state, double lookahead_s) const {
    const auto& checked = CheckedState("state", model_->model(), state);
    const controller::SteeringError away = aim_->At(checked, lookahead_s);
    return py::make_tuple(Copy(away.error), Copy(away.rate));
  }

 private:
  controller::Reference reference_;
  std::shared_ptr<ModelHandle> model_;
  std::unique_ptr<controller::Aim> aim_;
};

py::object PartsObject(const ControllerParts& parts, const std::shared_ptr<ModelHandle>& model) {
  Eigen::MatrixXd limits(static_cast<Eigen::Index>(parts.options.motors.size()), 3);
  for (Eigen::Index i = 0; i < limits.rows(); ++i) {
    const controller::MotorLimits& l = parts.options.motors[static_cast<std::size_t>(i)];
    limits.row(i) << l.min_tension_n, l.max_tension_n, l.max_rate_n_s;
  }
  auto reference = std::make_unique<ReferenceHandle>(parts, model);
  const controller::Reference goal(parts.options.goal, parts.model.robot);
  using namespace py::literals;
  return py::module_::import("mantle.parts")
      .attr("ControllerParts")(
          "model"_a = model, "motors"_a = MotorNames(parts.model), "limits"_a = CopyMatrix(limits),
          "period_s"_a = parts.options.period_s, "reference"_a = std::move(reference),
          "pull_directions"_a = CopyMatrix(controller::PullDirections(parts.model, goal.arm())));
}

py::object StateOrNone(const reduced::ReducedState* state) {
  return state == nullptr ? py::none() : StateObject(*state);
}

class FromPython final : public controller::Controller {
 public:
  FromPython(Session& session, const ControllerParts& parts, const py::object& make)
      : session_(session),
        motors_(MotorNames(parts.model)),
        model_(std::make_shared<ModelHandle>(parts.model, parts.step, parts.options.grid.step_s)),
        object_(std::make_unique<Held>(make(PartsObject(parts, model_.handle)))) {
    command_ = object_->Method("command");
    if (command_.is_none()) {
      throw py::type_error("a controller must have a method command(time_s, estimate, tensions)");
    }
    start_ = object_->Method("start");
    update_ = object_->Method("update");
    prepare_ = object_->Method("prepare");
    limits_ = object_->Method("set_limits");
  }

  ~FromPython() override {
    const py::gil_scoped_acquire interpreter;
    for (py::object* method : {&command_, &start_, &update_, &prepare_, &limits_}) {
      *method = py::object();
    }
    object_.reset();
  }

  void Start(const reduced::ReducedState& estimate) override {
    InPython(session_, [&] {
      if (!start_.is_none()) start_(StateObject(estimate));
    });
  }

  void Update(double t_s, const reduced::ReducedState* estimate,
              const Eigen::Ref<const VectorX>& tensions, std::int64_t) override {
    InPython(session_, [&] {
      if (!update_.is_none()) update_(t_s, StateOrNone(estimate), Copy(tensions));
    });
  }

  void Prepare(double t_s, const Eigen::Ref<const VectorX>& tensions) override {
    InPython(session_, [&] {
      if (!prepare_.is_none()) prepare_(t_s, Copy(tensions));
    });
  }

  void SetLimits(const std::vector<controller::MotorLimits>& limits) override {
    InPython(session_, [&] {
      if (limits_.is_none()) return;
      Eigen::MatrixXd rows(static_cast<Eigen::Index>(limits.size()), 3);
      for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const controller::MotorLimits& l = limits[static_cast<std::size_t>(i)];
        rows.row(i) << l.min_tension_n, l.max_tension_n, l.max_rate_n_s;
      }
      limits_(CopyMatrix(rows));
    });
  }

  void Command(double t_s, const reduced::ReducedState* estimate,
               Eigen::Ref<VectorX> tensions) override {
    InPython(session_, [&] {
      const py::array_t<double> last = Copy(tensions);
      const py::object result = command_(t_s, StateOrNone(estimate), last);
      const Numbers numbers = result.is_none() ? Numbers(last) : Numbers(result);
      tensions = Tensions(numbers);
    });
  }

 private:
  Eigen::VectorXd Tensions(const Numbers& numbers) const {
    const auto count = static_cast<py::ssize_t>(motors_.size());
    if (numbers.ndim() == 1 && numbers.shape(0) != count) {
      throw tools::BadInput(fmt::format("command: returned {} tensions, must be {}, one per motor",
                                        numbers.size(), count));
    }
    for (py::ssize_t i = 0; i < count && numbers.ndim() == 1; ++i) {
      if (std::isfinite(numbers.at(i))) continue;
      throw tools::BadInput(fmt::format("command: tension of motor \"{}\": {} N: must be finite",
                                        motors_[static_cast<std::size_t>(i)], numbers.at(i)));
    }
    return VectorOf("command", numbers, count);
  }

  Session& session_;
  std::vector<std::string> motors_;
  RunModel model_;
  std::unique_ptr<Held> object_;
  py::object command_, start_, update_, prepare_, limits_;
};

}  // namespace

void RaiseBadInput(const std::exception& error) {
  const auto* python = dynamic_cast<const py::builtin_exception*>(&error);
  if (python != nullptr) {
    python->set_error();
  } else {
    PyErr_SetString(py::module_::import("mantle.errors").attr("BadInput").ptr(), error.what());
  }
  throw py::error_already_set();
}

Session::MakeController UserController(const py::object& make) {
  if (make.is_none()) return {};
  if (PyCallable_Check(make.ptr()) == 0) {
    throw py::type_error("controller: must be a class or function that makes one of its parts");
  }
  return [make](const ControllerParts& parts) -> std::unique_ptr<controller::Controller> {
    std::unique_ptr<controller::Controller> made;
    Session& session = *Session::Current();
    InPython(session, [&] { made = std::make_unique<FromPython>(session, parts, make); });
    if (!made) throw std::runtime_error("the controller could not be made");
    return made;
  };
}

void BindUserController(py::module_& m) {
  py::class_<ReferenceHandle>(m, "Reference")
      .def("at", &ReferenceHandle::At, py::arg("time_s"))
      .def("aim", &ReferenceHandle::Aim, py::arg("state"), py::arg("lookahead_s") = 0.0);
}

}  // namespace mantle::python
