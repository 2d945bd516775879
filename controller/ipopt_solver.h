#pragma once

#include <memory>

#include "controller/program.h"

/// @file
/// Ipopt with MUMPS, behind the seam Solver. Two ways lead to it: a library user links
/// mantle::ipopt, which makes it what MakeSolver() gives; the program `mantle` opens it as a
/// module.

namespace mantle::controller {

/// A solver by Ipopt. One that cannot be set up (no MUMPS in this Ipopt) answers every Solve with
/// SolveStatus::kFailed.
std::unique_ptr<Solver> MakeIpoptSolver();

}  // namespace mantle::controller
