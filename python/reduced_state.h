#pragma once

#include <pybind11/pybind11.h>

#include "reduced/reduced_model.h"

namespace mantle::python {

namespace py = pybind11;

/// A state of a reduced model with its own numbers, in the earth's frame. Its vectors never move,
/// so that arrays may look at them.
struct StateBox {
  reduced::ReducedState state;
};

/// A new Python object with a copy of the state.
py::object StateObject(const reduced::ReducedState& state);

/// The state, if `model` can take it. Throws tools::BadInput that begins with `what`: of another
/// size, not finite, or with a quaternion whose length is not 1.
const reduced::ReducedState& CheckedState(const std::string& what,
                                          const reduced::ReducedModel& model, const StateBox& box);

}  // namespace mantle::python
