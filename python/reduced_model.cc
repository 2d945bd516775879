#include "python/reduced_model.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <cmath>

#include "python/bindings.h"
#include "python/body_shape.h"
#include "python/reduced_state.h"
#include "reduced/outputs.h"
#include "reduced/water_frame.h"
#include "tools/mantle/bad_input.h"

namespace mantle::python {

using reduced::ReducedModel;
using reduced::ReducedState;

ModelHandle::ModelHandle(const LoadedScene& scene)
    : own_(InScene(scene,
                   [&] {
                     return std::make_unique<reduced::ReducedPlant>(scene.scene.robot,
                                                                    scene.scene.reduction);
                   })),
      model_(own_.get()),
      run_(reduced::RunSettingsOf(scene.scene.run, scene.scene.reduction)),
      settings_(run_.step),
      longest_step_s_(run_.step_s) {}

ModelHandle::ModelHandle(const ReducedModel& model, const reduced::StepSettings& settings,
                         double longest_step_s)
    : model_(&model), settings_(settings), longest_step_s_(longest_step_s) {}

ReducedState ModelHandle::Start() const {
  ReducedState start =
      own_ ? reduced::ReducedSimulation(*own_, run_).state() : InitialState(model());
  ToEarth(EvaluateWater(model().robot.effects, start.time_s), &start);
  return start;
}

void ModelHandle::End() {
  if (!own_) model_ = nullptr;
}

const ReducedModel& ModelHandle::model() const {
  if (model_ == nullptr) {
    throw tools::BadInput(
        "this model was a run's, and the run has ended: mantle.ReducedModel(scene) makes one to "
        "keep");
  }
  return *model_;
}

const reduced::ReducedPlant& ModelHandle::plant_model() const {
  if (own_) return *own_;
  model();
  throw tools::BadInput(
      "the model of a run has no plant beside it: mantle.ReducedModel(scene) makes one that has");
}

namespace {

template <typename Work>
Work& Made(std::unique_ptr<Work>& work, const auto& model) {
  if (!work) work = std::make_unique<Work>(model);
  return *work;
}

}  // namespace

reduced::StepWork& ModelHandle::step_work() { return Made(step_work_, model()); }
reduced::ReducedWork& ModelHandle::work() { return Made(work_, model()); }
reduced::ReducedJacobians& ModelHandle::jacobians() { return Made(jacobians_, model()); }
reduced::Projection& ModelHandle::projection() { return Made(projection_, plant_model()); }

int ArmOf(const ReducedModel& model, const std::string& name) {
  std::string known;
  for (std::size_t a = 0; a < model.robot.arms.size(); ++a) {
    if (model.robot.arms[a].name == name) return static_cast<int>(a);
    known += (a == 0 ? "" : ", ") + model.robot.arms[a].name;
  }
  if (name.empty() && model.robot.arms.size() == 1) return 0;
  throw tools::BadInput(name.empty()
                            ? fmt::format("arm: must be one of {}", known.empty() ? "none" : known)
                            : fmt::format("no arm is called \"{}\"; known: {}", name, known));
}

std::vector<std::string> MotorNames(const ReducedModel& model) {
  std::vector<std::string> names;
  for (const reduced::Actuator& motor : model.actuators) names.push_back(motor.name);
  return names;
}

namespace {

constexpr double kLostStep = 1e-3;
constexpr double kSameTime_s = 1e-12;  // as a run of the reduced model has it

bool HasCurrent(const ReducedModel& model) {
  return model.robot.effects.current_m_s || model.robot.effects.unsteady_current;
}

// The schedules' values, with a motor's tension where they are given.
void Inputs(const ReducedModel& model, double t_s, bool from_left,
            const std::optional<Eigen::VectorXd>& tensions, model::PlantInputs* inputs) {
  EvaluateInputs(model, t_s, from_left, inputs);
  if (tensions) ApplyControls(model, tensions->data(), inputs);
}

std::optional<Eigen::VectorXd> Tensions(const ReducedModel& model,
                                        const std::optional<Numbers>& tensions) {
  if (!tensions) return {};
  return VectorOf("tensions", *tensions, model.input_count());
}

/// A step of a state of the earth's, in parts that end at break points and are no longer than the
/// model's step, as ReducedSimulation divides it.
class EarthStep {
 public:
  EarthStep(ModelHandle& handle, const ReducedState& from, std::optional<Eigen::VectorXd> tensions,
            bool differentiate)
      : handle_(handle),
        model_(handle.model()),
        tensions_(std::move(tensions)),
        state_(from),
        next_(from) {
    if (!differentiate) return;
    if (HasCurrent(model_)) {
      throw tools::BadInput("step: jacobian: is for water at rest, this model has a current");
    }
    const int n = model_.velocity_count();
    total_.emplace(model_);
    part_.emplace(model_);
    total_->state.setIdentity(2 * n, 2 * n);
    total_->input.setZero(2 * n, model_.input_count());
  }

  void Take(double dt_s) {
    const double end = state_.time_s + dt_s;
    // A share of the step that the time's own digits may lose.
    if (std::abs(end - state_.time_s - dt_s) > kLostStep * dt_s) {
      throw tools::BadInput(
          fmt::format("step: dt_s: {} s: is lost in the digits of the state's time, {} s", dt_s,
                      state_.time_s));
    }
    while (state_.time_s < end - kSameTime_s) {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      const double breakpoint = NextBreakpoint(model_.robot, state_.time_s);
      const bool at_breakpoint = breakpoint <= end + kSameTime_s;
      const double next = at_breakpoint ? breakpoint : end;
      const double remaining = next - state_.time_s;
      const double count = std::max(std::ceil(remaining / handle_.longest_step_s() - 1e-9), 1.0);
      Part(remaining / count, count <= 1.0 ? std::optional(next) : std::nullopt);
      if (count <= 1.0 && at_breakpoint) CrossKink();
    }
  }

  const ReducedState& state() const { return state_; }
  const reduced::StepJacobian& jacobian() const { return *total_; }

 private:
  void Part(double h, std::optional<double> end_s) {
    const double t = state_.time_s, share = FirstStageTime(handle_.settings().scheme);
    Inputs(model_, t + share * h, share == 1.0, tensions_, &first_);
    Inputs(model_, t + h, true, tensions_, &last_);
    ReducedState from = state_;
    ToWater(EvaluateWater(model_.robot.effects, t), &from);
    const reduced::StepOutcome outcome =
        TakeStep(model_, handle_.settings(), h, from, first_, last_, &handle_.step_work(), &next_,
                 part_ ? &*part_ : nullptr);
    if (!outcome.ok) {
      throw tools::CannotGoOn(fmt::format("t = {:.6g} s: {}", t, outcome.Message()));
    }
    state_ = next_;
    if (end_s) state_.time_s = *end_s;
    ToEarth(EvaluateWater(model_.robot.effects, state_.time_s), &state_);
    if (!part_) return;
    total_->input = part_->state * total_->input + part_->input;
    total_->state = part_->state * total_->state;
  }

  // A prescribed root may have a kink at a break point.
  void CrossKink() {
    if (model_.root_free()) return;
    EvaluateInputs(model_, state_.time_s, false, &first_);
    const Eigen::VectorXd before = state_.v;
    ToWater(EvaluateWater(model_.robot.effects, state_.time_s), &state_);
    if (const auto failure =
            CrossRootKink(model_, first_, &handle_.work(), &handle_.jacobians(), &state_)) {
      throw tools::CannotGoOn(fmt::format("t = {:.6g} s: after the kink of the root's motion: {}",
                                          state_.time_s, failure.Message()));
    }
    ToEarth(EvaluateWater(model_.robot.effects, state_.time_s), &state_);
    if (total_ && (state_.v - before).cwiseAbs().maxCoeff() > 1e-12) {
      throw tools::BadInput(fmt::format(
          "step: jacobian: the root's motion has a kink at {:.6g} s: steps must end there",
          state_.time_s));
    }
  }

  ModelHandle& handle_;
  const ReducedModel& model_;
  std::optional<Eigen::VectorXd> tensions_;
  ReducedState state_, next_;
  model::PlantInputs first_, last_;
  std::optional<reduced::StepJacobian> total_, part_;
};

py::object Step(ModelHandle& handle, const StateBox& state, double dt_s,
                const std::optional<Numbers>& tensions, bool jacobian) {
  const ReducedModel& model = handle.model();
  if (!(std::isfinite(dt_s) && dt_s > 0)) {
    throw tools::BadInput(fmt::format("step: dt_s: {} s: must be finite and > 0", dt_s));
  }
  EarthStep step(handle, CheckedState("state", model, state), Tensions(model, tensions), jacobian);
  step.Take(dt_s);
  if (!jacobian) return StateObject(step.state());
  return py::make_tuple(StateObject(step.state()), CopyMatrix(step.jacobian().state),
                        CopyMatrix(step.jacobian().input));
}

py::dict LineariseAt(ModelHandle& handle, const StateBox& box, const Numbers& acceleration,
                     const std::optional<Numbers>& tensions) {
  const ReducedModel& model = handle.model();
  ReducedState state = CheckedState("state", model, box);
  const Eigen::VectorXd a = VectorOf("acceleration", acceleration, model.velocity_count());
  model::PlantInputs inputs;
  Inputs(model, state.time_s, false, Tensions(model, tensions), &inputs);
  ToWater(EvaluateWater(model.robot.effects, state.time_s), &state);
  if (const auto failure = EvaluateResidual(model, state, a, inputs, &handle.work())) {
    throw tools::CannotGoOn(failure.Message());
  }
  reduced::ReducedJacobians& j = handle.jacobians();
  Linearise(model, state, a, inputs, true, &handle.work(), &j);
  py::dict out;
  out["residual"] = Copy(handle.work().residual);
  out["stiffness"] = CopyMatrix(j.stiffness);
  out["damping"] = CopyMatrix(j.damping);
  out["mass"] = CopyMatrix(j.mass);
  out["input"] = CopyMatrix(j.input);
  return out;
}

py::array_t<double> Acceleration(ModelHandle& handle, const StateBox& box,
                                 const std::optional<Numbers>& tensions) {
  const ReducedModel& model = handle.model();
  ReducedState state = CheckedState("state", model, box);
  model::PlantInputs inputs;
  Inputs(model, state.time_s, false, Tensions(model, tensions), &inputs);
  ToWater(EvaluateWater(model.robot.effects, state.time_s), &state);
  Eigen::VectorXd a = Eigen::VectorXd::Zero(model.velocity_count());
  if (const auto failure =
          SolveAcceleration(model, state, inputs, &handle.work(), &handle.jacobians(), &a)) {
    throw tools::CannotGoOn(failure.Message());
  }
  return Copy(a);
}

// The tip in the world, and its derivative in (zeta of the root, q).
py::tuple Tip(ModelHandle& handle, const StateBox& box, const std::string& name) {
  const ReducedModel& model = handle.model();
  const ReducedState& state = CheckedState("state", model, box);
  const int arm = ArmOf(model, name), first = model.arm_first(arm);
  const reduced::ReducedArm& chain = model.arms[static_cast<std::size_t>(arm)];
  Eigen::Matrix3Xd by_q(3, chain.size());
  Eigen::Ref<Eigen::Matrix3Xd> by_arm = by_q;
  const model::Pose tip = EvaluateTip(chain, state.q.data() + first, &by_arm);
  const Eigen::Matrix3d r = state.root.rotation.toRotationMatrix();
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3, model.velocity_count());
  jacobian.leftCols<3>() = -r * model::Hat(tip.position);
  jacobian.middleCols<3>(3) = r;
  jacobian.middleCols(6 + first, chain.size()) = r * by_q;
  const model::Vector3 place = state.root.position + r * tip.position;
  return py::make_tuple(Copy(place), CopyMatrix(jacobian));
}

py::tuple Volume(ModelHandle& handle, const StateBox& box) {
  const ReducedModel& model = handle.model();
  const ReducedState& state = CheckedState("state", model, box);
  if (!model.mantle) throw tools::BadInput("volume: this robot has no mantle");
  reduced::VolumeFunction function(*model.mantle);
  const double volume = function.Evaluate(state.q.data() + model.mantle_first());
  Eigen::VectorXd by_q = Eigen::VectorXd::Zero(model.coordinate_count());
  by_q.segment(model.mantle_first(), model.mantle->size) = function.gradient();
  return py::make_tuple(volume, Copy(by_q));
}

std::unique_ptr<BodyShape> Lift(ModelHandle& handle, const StateBox& box) {
  const reduced::ReducedPlant& model = handle.plant_model();
  ReducedState state = CheckedState("state", model, box);
  ToWater(EvaluateWater(model.robot.effects, state.time_s), &state);
  model::PlantState lifted = model::InitialState(model.plant);
  handle.projection().Lift(state, &lifted);
  auto shape = std::make_unique<BodyShape>(model.plant);
  shape->Set(model.plant, lifted);
  return shape;
}

py::array_t<double> Difference(ModelHandle& handle, const StateBox& from, const StateBox& to) {
  const ReducedModel& model = handle.model();
  Eigen::VectorXd d(2 * model.velocity_count());
  StateDifference(CheckedState("from_state", model, from), CheckedState("to_state", model, to), d);
  return Copy(d);
}

py::object Move(ModelHandle& handle, const StateBox& box, const Numbers& by) {
  const ReducedModel& model = handle.model();
  const ReducedState& from = CheckedState("state", model, box);
  ReducedState to = from;
  MoveState(from, VectorOf("by", by, 2 * model.velocity_count()), &to);
  return StateObject(to);
}

}  // namespace

void BindReducedModel(py::module_& m) {
  py::class_<ModelHandle, std::shared_ptr<ModelHandle>>(m, "ReducedModel")
      .def(py::init<const LoadedScene&>(), py::arg("scene"))
      .def_property_readonly("motors", [](ModelHandle& h) { return MotorNames(h.model()); })
      .def_property_readonly("coordinate_count",
                             [](ModelHandle& h) { return h.model().coordinate_count(); })
      .def_property_readonly("velocity_count",
                             [](ModelHandle& h) { return h.model().velocity_count(); })
      .def_property_readonly("body_length_m",
                             [](ModelHandle& h) { return h.model().body_length_m; })
      .def_property_readonly("longest_step_s",
                             [](ModelHandle& h) { return h.model(), h.longest_step_s(); })
      .def("state", [](ModelHandle& h) { return StateObject(h.Start()); })
      .def("step", Step, py::arg("state"), py::arg("dt_s"), py::arg("tensions") = py::none(),
           py::kw_only(), py::arg("jacobian") = false)
      .def("linearise", LineariseAt, py::arg("state"), py::arg("acceleration"),
           py::arg("tensions") = py::none())
      .def("acceleration", Acceleration, py::arg("state"), py::arg("tensions") = py::none())
      .def("tip", Tip, py::arg("state"), py::arg("arm") = "")
      .def("volume", Volume, py::arg("state"))
      .def("shape", Lift, py::arg("state"))
      .def("difference", Difference, py::arg("from_state"), py::arg("to_state"))
      .def("move", Move, py::arg("state"), py::arg("by"));
}

}  // namespace mantle::python
