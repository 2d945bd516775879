#pragma once

#include <memory>

#include "controller/program.h"

/// @file
/// Strictly convex quadratic programs solved to the end, behind the seam Solver.

namespace mantle::controller {

/// Where the active set of a program is looked for first.
enum class FirstGuess {
  kNone,        ///< nothing held
  kOtherSolver  ///< what the other solver's multipliers say
};

/// A solver by the dual active-set method (controller/active_set.h): the exact active set, with
/// multipliers that are zero off it and residuals of round-off, for any scale of the objective.
///
/// `iterations` counts the points looked at. A solve that its budget or deadline ends leaves the
/// last feasible point from the program's start towards the method's; since that one is a lower
/// bound of the solution, the point is no worse than a feasible start. What is no quadratic program
/// or not strictly convex goes to `other` (which may be null: then it fails), which also gives the
/// guess where it is asked to.
std::unique_ptr<Solver> MakeActiveSetSolver(std::unique_ptr<Solver> other,
                                            FirstGuess guess = FirstGuess::kNone);

}  // namespace mantle::controller
