#include <stdexcept>

#include "controller/program.h"

namespace mantle::controller {
namespace {

SolverFactory g_factory = nullptr;  // set before main where mantle::ipopt is linked

}  // namespace

void SetSolverFactory(SolverFactory factory) { g_factory = factory; }

std::unique_ptr<Solver> MakeSolver() {
  if (g_factory == nullptr) {
    throw std::runtime_error(
        "a plan needs a solver, and this program has none: link mantle::ipopt, or call "
        "controller::SetSolverFactory");
  }
  return g_factory();
}

std::string_view ToString(SolveStatus status) {
  switch (status) {
    case SolveStatus::kSolved:
      return "solved";
    case SolveStatus::kAcceptable:
      return "solved to the acceptable tolerance";
    case SolveStatus::kIterationBudget:
      return "stopped by the iteration budget";
    case SolveStatus::kDeadline:
      return "stopped by the deadline";
    case SolveStatus::kInfeasible:
      return "no feasible point near by";
    case SolveStatus::kDiverging:
      return "iterates diverge";
    case SolveStatus::kTooSmallStep:
      return "steps became too small";
    case SolveStatus::kBadNumber:
      return "a function was not finite";
    case SolveStatus::kFailed:
      break;
  }
  return "the solver failed";
}

}  // namespace mantle::controller
