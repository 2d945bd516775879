
#include <pybind11/pybind11.h>

#include "mantle/version.h"
#include "model/rod.h"
#include "python/bindings.h"
#include "python/session.h"
#include "tools/mantle/bad_input.h"

namespace mantle::python {
namespace {

void Raise(const char* type, const std::exception& error) {
  PyErr_SetString(py::module_::import("mantle.errors").attr(type).ptr(), error.what());
}

// As the exit statuses of the program (tools/mantle/exit_status.h). What Python itself raised, and
// what pybind11 says of arguments, stays as it is.
void Translate(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const py::error_already_set&) {
    throw;
  } catch (const py::builtin_exception&) {
    throw;
  } catch (const tools::BadInput& error) {
    Raise("BadInput", error);
  } catch (const tools::CannotGoOn& error) {
    Raise("CannotGoOn", error);
  } catch (const std::invalid_argument& error) {  // a scene or robot that cannot be
    Raise("BadInput", error);
  } catch (const std::system_error& error) {
    Raise("BadInput", error);
  } catch (const std::logic_error&) {
    throw;
  } catch (const std::runtime_error& error) {
    Raise("Fault", error);
  }
}

}  // namespace

PYBIND11_MODULE(_mantle, m) {
  m.attr("__version__") = kVersion;
  py::register_exception_translator(Translate);
  RegisterUserTypes();
  BindScene(m);
  BindShape(m);
  BindSimulation(m);
  BindReducedState(m);
  BindReducedModel(m);
  BindUserController(m);
  BindClosedLoop(m);
  BindEpisode(m);
}

}  // namespace mantle::python
