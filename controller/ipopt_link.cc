#include "controller/ipopt_solver.h"

// Linked only where the program links mantle::ipopt, which asks the linker for this name.
extern "C" const bool mantle_link_ipopt;
extern "C" const bool mantle_link_ipopt = [] {
  mantle::controller::SetSolverFactory(mantle::controller::MakeIpoptSolver);
  return true;
}();
