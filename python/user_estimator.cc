#include <memory>

#include "python/arrays.h"
#include "python/reduced_model.h"
#include "python/reduced_state.h"
#include "python/user_parts.h"
#include "reduced/outputs.h"

namespace mantle::python {
namespace {

using controller::EstimatorParts;
using model::VectorX;

class FromPython final : public controller::Estimator {
 public:
  FromPython(Session& session, const EstimatorParts& parts, const py::object& make)
      : session_(session),
        run_model_(parts.model),
        model_(std::make_shared<ModelHandle>(parts.model, parts.step, kLongestStep_s)),
        state_(reduced::InitialState(parts.model)),
        none_(parts.model.input_count()) {
    using namespace py::literals;
    py::list motors;
    for (const std::string& name : MotorNames(parts.model)) motors.append(name);
    const py::object given =
        py::module_::import("mantle.parts")
            .attr("EstimatorParts")("model"_a = model_.handle, "motors"_a = motors);
    object_ = std::make_unique<Held>(make(given));
    start_ = object_->Method("start");
    update_ = object_->Method("update");
    if (update_.is_none()) {
      throw py::type_error("an estimator must have a method update(time_s, tensions, measured)");
    }
  }

  ~FromPython() override {
    const py::gil_scoped_acquire interpreter;
    start_ = update_ = py::object();
    object_.reset();
  }

  void Start(const reduced::ReducedState& state) override {
    state_ = state;
    InPython(session_, [&] {
      if (!start_.is_none()) Take("start", start_(StateObject(state)), state.time_s);
    });
  }

  void Update(double t_s, const Eigen::Ref<const VectorX>& tensions,
              const reduced::ReducedState* measured) override {
    InPython(session_, [&] {
      const py::object seen = measured == nullptr ? py::none() : StateObject(*measured);
      Take("update", update_(t_s, Copy(tensions), seen), t_s);
    });
    state_.time_s = t_s;
  }

  const reduced::ReducedState& state() const override { return state_; }
  const controller::Disturbance& disturbance() const override { return none_; }

 private:
  static constexpr double kLongestStep_s = 0.05;

  void Take(const char* what, const py::object& estimate, double t_s) {
    if (estimate.is_none()) return;
    if (!py::isinstance<StateBox>(estimate)) {
      throw py::type_error(std::string(what) + ": must return a ReducedState or None");
    }
    const auto& box = estimate.cast<const StateBox&>();
    state_ = CheckedState(std::string(what) + ": the state that was returned", run_model_, box);
    state_.time_s = t_s;
  }

  Session& session_;
  const reduced::ReducedModel& run_model_;
  RunModel model_;
  std::unique_ptr<Held> object_;
  py::object start_, update_;
  reduced::ReducedState state_;
  controller::Disturbance none_;
};

}  // namespace

Session::MakeEstimator UserEstimator(const py::object& make) {
  if (make.is_none()) return {};
  if (PyCallable_Check(make.ptr()) == 0) {
    throw py::type_error("estimator: must be a class or function that makes one of its parts");
  }
  return [make](const EstimatorParts& parts) -> std::unique_ptr<controller::Estimator> {
    std::unique_ptr<controller::Estimator> made;
    Session& session = *Session::Current();
    InPython(session, [&] { made = std::make_unique<FromPython>(session, parts, make); });
    if (!made) throw std::runtime_error("the estimator could not be made");
    return made;
  };
}

}  // namespace mantle::python
