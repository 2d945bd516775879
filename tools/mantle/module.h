#pragma once

#include <filesystem>

#include "controller/program.h"

/// Modules: what the program loads when it first needs it, so that a short command does not wait
/// for libraries it never calls. `mantle_ipopt.so` holds the solver, `mantle_lcm.so` the LCM
/// bridge. They stand beside the program, in lib/mantle/modules (as built) or ../lib/mantle/modules
/// (as installed), and stay loaded until it ends. Each says with which version it was built;
/// another one is refused.

namespace mantle::tools {

/// Where a module is expected: the first of the two folders that has it, else the last.
std::filesystem::path ModulePath(const char* module);

/// The address of a C symbol of a module. Throws std::runtime_error that names the file: it is
/// missing, cannot be loaded (the loader's own words), is of another version, or has no such
/// symbol. May be called from any thread.
void* ModuleSymbol(const char* module, const char* symbol);

/// Ipopt from its module; a controller::SolverFactory. Throws as ModuleSymbol.
std::unique_ptr<controller::Solver> MakeModuleSolver();

}  // namespace mantle::tools
