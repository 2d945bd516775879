#include "controller/ipopt_solver.h"
#include "mantle/version.h"

// What the program looks up in mantle_ipopt.so (tools/mantle/module.h).
extern "C" {

const char* mantle_module_version() { return mantle::kVersion; }

mantle::controller::Solver* mantle_make_solver() {
  return mantle::controller::MakeIpoptSolver().release();
}

}  // extern "C"
