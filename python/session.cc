#include "python/session.h"

#include <unistd.h>

#include <utility>

#include "controller/registry.h"
#include "tools/mantle/bad_input.h"

namespace mantle::python {
namespace {

constexpr auto kLookEvery = std::chrono::milliseconds(20);

thread_local Session* current = nullptr;
std::atomic<int> count{0};

}  // namespace

Session::Session(MakeController make_controller, MakeEstimator make_estimator)
    : make_controller_(std::move(make_controller)), make_estimator_(std::move(make_estimator)) {
  if (current != nullptr) {
    throw tools::BadInput(
        "a run cannot begin another in its own thread: a controller, estimator or observer steps "
        "models by ReducedModel or Simulation");
  }
  current = this;
  ++count;
}

Session::~Session() {
  current = nullptr;
  --count;
}

Session* Session::Current() { return current; }
int Session::Count() { return count; }

bool Session::Interrupted() {
  if (failed_) return true;
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < kLookEvery) return false;
  looked_ = now;
  if (getpid() != gettid()) return false;  // handlers run in the main thread alone
  const py::gil_scoped_acquire interpreter;
  if (PyErr_CheckSignals() == 0) return false;
  py::error_already_set error;
  Keep(error);
  return true;
}

void Session::Keep(py::error_already_set& error) {
  if (!failed_) error_.emplace(error);
  failed_ = true;
}

void Session::Rethrow() {
  if (error_) throw py::error_already_set(*error_);
}

void RegisterUserTypes() {
  controller::RegisterController({"python", [](const controller::ControllerParts& parts) {
                                    if (current == nullptr || !current->make_controller()) {
                                      throw std::invalid_argument(
                                          "controller \"python\": stands for one that is given to "
                                          "a run in Python: mantle.run(SCENE, controller=...)");
                                    }
                                    return current->make_controller()(parts);
                                  }});
  controller::RegisterEstimator({"python", [](const controller::EstimatorParts& parts) {
                                   if (current == nullptr || !current->make_estimator()) {
                                     throw std::invalid_argument(
                                         "estimator \"python\": stands for one that is given to a "
                                         "run in Python: mantle.run(SCENE, estimator=...)");
                                   }
                                   return current->make_estimator()(parts);
                                 }});
}

}  // namespace mantle::python
