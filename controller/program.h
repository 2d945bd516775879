#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <string_view>
#include <vector>

namespace mantle::controller {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Positions of the entries of a sparse matrix.
struct SparsePattern {
  std::vector<int> row, column;
};

/// A nonlinear program  min f(x)  s.t.  x_l <= x <= x_u, g_l <= g(x) <= g_u, and the seam behind
/// which its solver stands.
class Program {
 public:
  virtual ~Program() = default;

  virtual int variables() const = 0;
  virtual int constraints() const = 0;
  virtual void Bounds(double* x_low, double* x_high, double* g_low, double* g_high) const = 0;
  virtual void Start(double* x) const = 0;
  virtual const SparsePattern& JacobianPattern() const = 0;
  /// Lower triangle of the Hessian of f + lambda^T g, or an approximation of it.
  virtual const SparsePattern& HessianPattern() const = 0;
  /// f is quadratic and g linear: derivatives are evaluated once.
  virtual bool quadratic() const = 0;

  /// False where the functions cannot be evaluated at x. `fresh`: x differs from the last call's.
  virtual bool Objective(const double* x, bool fresh, double* f) = 0;
  virtual bool Gradient(const double* x, bool fresh, double* gradient) = 0;
  virtual bool Constraints(const double* x, bool fresh, double* g) = 0;
  virtual bool Jacobian(const double* x, bool fresh, double* values) = 0;
  virtual bool Hessian(const double* x, bool fresh, double objective_factor, const double* lambda,
                       double* values) = 0;
};

enum class SolveStatus {
  kSolved,
  kAcceptable,       ///< to the looser of the solver's two tolerances
  kIterationBudget,  ///< stopped by max_iterations
  kDeadline,         ///< stopped by the clock
  kInfeasible,       ///< locally infeasible
  kDiverging,
  kTooSmallStep,  ///< search direction became too small, or restoration failed
  kBadNumber,     ///< a function could not be evaluated, or was not finite
  kFailed,        ///< anything else
};
/// "solved", "stopped by the iteration budget", ...
std::string_view ToString(SolveStatus status);

/// What bounds one solve.
struct SolveOptions {
  double tolerance{1e-4};
  int max_iterations{30};
  /// Monotonic clock [ns] (std::chrono::steady_clock) after which to stop; 0: none.
  std::int64_t deadline_ns{0};
  double initial_barrier{1e-4};
  bool fast{true};  ///< options measured to be fast on small problems (docs/controller.md)
};

/// Where a solve ended, with its multipliers.
struct SolveResult {
  SolveStatus status{SolveStatus::kFailed};
  int iterations{0};
  double seconds{0};
  double objective{0};
  /// Residuals of the optimality conditions at `x`, largest entries: of the constraints and bounds,
  /// of the Lagrangian's gradient, of the products with the multipliers.
  double infeasibility{0}, stationarity{0}, complementarity{0};
  Eigen::VectorXd x, lambda, z_low, z_high;  ///< multipliers as in f + lambda g - z_l x + z_u x

  bool usable() const {
    return status == SolveStatus::kSolved || status == SolveStatus::kAcceptable;
  }
};

/// The seam behind which solvers stand. One object serves one thread.
class Solver {
 public:
  virtual ~Solver() = default;
  /// Never throws; fills `result` (whose vectors keep their storage).
  virtual void Solve(Program& program, const SolveOptions& options, SolveResult* result) = 0;
};

/// Makes a solver; never returns null.
using SolverFactory = std::unique_ptr<Solver> (*)();

/// Which solver MakeSolver() gives from now on. Linking mantle::ipopt sets Ipopt before main; a
/// program may set another, also one that loads its code at the first call. Not to be called while
/// another thread makes solvers.
void SetSolverFactory(SolverFactory factory);

/// A solver of the factory that was set. Throws std::runtime_error where none was, and what the
/// factory throws.
std::unique_ptr<Solver> MakeSolver();

}  // namespace mantle::controller
