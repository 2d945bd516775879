#pragma once

#include <pybind11/pybind11.h>

/// @file
/// What the module `mantle._mantle` holds: one heavy type for each source file. Docstrings for
/// users stand in python/mantle/_mantle.pyi and the modules around it.

namespace mantle::python {

namespace py = pybind11;

void BindScene(py::module_& m);
void BindShape(py::module_& m);
void BindSimulation(py::module_& m);
void BindReducedState(py::module_& m);
void BindReducedModel(py::module_& m);
void BindUserController(py::module_& m);
void BindClosedLoop(py::module_& m);
void BindEpisode(py::module_& m);

}  // namespace mantle::python
