#pragma once

#include <pybind11/pybind11.h>

#include "python/session.h"

/// @file
/// Controllers and estimators written in Python, in the loop. What they are called with are values
/// of their own, which stay good; the model that they are given is the run's and ends with it. The
/// interpreter is taken for their calls alone. What they raise ends the run in order, its drives
/// stopped and its results kept as partial ones, and is raised again where the run was begun.

namespace mantle::python {

/// `make(parts)` makes the controller of a run; empty where it is None. With the interpreter held.
/// Throws tools::BadInput where it cannot be called.
Session::MakeController UserController(const py::object& make);
Session::MakeEstimator UserEstimator(const py::object& make);

/// Calls `work` with the interpreter held; keeps in the session what it throws.
template <typename Work>
void InPython(Session& session, Work work);

/// With the interpreter held: the exception that a C++ one is to Python, raised.
[[noreturn]] void RaiseBadInput(const std::exception& error);

template <typename Work>
void InPython(Session& session, Work work) {
  if (session.failed()) return;
  const py::gil_scoped_acquire interpreter;
  try {
    try {
      work();
    } catch (const py::error_already_set&) {
      throw;
    } catch (const std::exception& error) {
      RaiseBadInput(error);
    }
  } catch (py::error_already_set& error) {
    session.Keep(error);
  }
}

/// An object of Python that may be let go of by a thread that does not hold the interpreter.
class Held {
 public:
  explicit Held(py::object object) : object_(std::move(object)) {}
  ~Held() {
    const py::gil_scoped_acquire interpreter;
    object_.release().dec_ref();
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  /// The method of that name, or none. With the interpreter held.
  py::object Method(const char* name) const {
    if (!py::hasattr(object_, name)) return py::none();
    return object_.attr(name);
  }

 private:
  py::object object_;
};

}  // namespace mantle::python
