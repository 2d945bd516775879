#include "controller/ipopt_solver.h"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>

namespace mantle::controller {
namespace {

using Ipopt::Index;
using Ipopt::Number;

constexpr double kIpoptInfinity = 2e19;  // nlp_upper_bound_inf is 1e19

std::int64_t Now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

class Adapter : public Ipopt::TNLP {
 public:
  void Set(Program* program, const SolveOptions& options, SolveResult* result) {
    program_ = program;
    options_ = options;
    result_ = result;
    late_ = false;
  }
  bool late() const { return late_; }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess,
                    IndexStyleEnum& style) override {
    n = program_->variables();
    m = program_->constraints();
    nnz_jac = static_cast<Index>(program_->JacobianPattern().row.size());
    nnz_hess = static_cast<Index>(program_->HessianPattern().row.size());
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* xl, Number* xu, Index m, Number* gl, Number* gu) override {
    program_->Bounds(xl, xu, gl, gu);
    const auto clip = [](Number* x, Index count) {
      for (Index i = 0; i < count; ++i) x[i] = std::clamp(x[i], -kIpoptInfinity, kIpoptInfinity);
    };
    clip(xl, n);
    clip(xu, n);
    clip(gl, m);
    clip(gu, m);
    return true;
  }

  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* zl, Number* zu,
                          Index m, bool init_lambda, Number* lambda) override {
    if (init_x) program_->Start(x);
    if (init_z) {
      std::fill_n(zl, n, 0.0);
      std::fill_n(zu, n, 0.0);
    }
    if (init_lambda) std::fill_n(lambda, m, 0.0);
    return true;
  }

  bool eval_f(Index, const Number* x, bool fresh, Number& f) override {
    return program_->Objective(x, fresh, &f) && std::isfinite(f);
  }
  bool eval_grad_f(Index, const Number* x, bool fresh, Number* grad) override {
    return program_->Gradient(x, fresh, grad);
  }
  bool eval_g(Index, const Number* x, bool fresh, Index, Number* g) override {
    return program_->Constraints(x, fresh, g);
  }
  bool eval_jac_g(Index, const Number* x, bool fresh, Index, Index, Index* row, Index* column,
                  Number* values) override {
    if (values == nullptr) return CopyPattern(program_->JacobianPattern(), row, column);
    return program_->Jacobian(x, fresh, values);
  }
  bool eval_h(Index, const Number* x, bool fresh, Number factor, Index, const Number* lambda, bool,
              Index, Index* row, Index* column, Number* values) override {
    if (values == nullptr) return CopyPattern(program_->HessianPattern(), row, column);
    return program_->Hessian(x, fresh, factor, lambda, values);
  }

  bool intermediate_callback(Ipopt::AlgorithmMode, Index, Number, Number, Number, Number, Number,
                             Number, Number, Number, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    late_ = options_.deadline_ns != 0 && Now_ns() > options_.deadline_ns;
    return !late_;
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number* zl,
                         const Number* zu, Index m, const Number*, const Number* lambda,
                         Number objective, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    result_->objective = objective;
    result_->x = Eigen::Map<const Eigen::VectorXd>(x, n);
    result_->z_low = Eigen::Map<const Eigen::VectorXd>(zl, n);
    result_->z_high = Eigen::Map<const Eigen::VectorXd>(zu, n);
    result_->lambda = Eigen::Map<const Eigen::VectorXd>(lambda, m);
  }

 private:
  static bool CopyPattern(const SparsePattern& pattern, Index* row, Index* column) {
    std::copy(pattern.row.begin(), pattern.row.end(), row);
    std::copy(pattern.column.begin(), pattern.column.end(), column);
    return true;
  }

  Program* program_{nullptr};
  SolveOptions options_;
  SolveResult* result_{nullptr};
  bool late_{false};
};

SolveStatus StatusOf(Ipopt::ApplicationReturnStatus status, bool late) {
  using namespace Ipopt;
  switch (status) {
    case Solve_Succeeded:
      return SolveStatus::kSolved;
    case Solved_To_Acceptable_Level:
      return SolveStatus::kAcceptable;
    case Maximum_Iterations_Exceeded:
      return SolveStatus::kIterationBudget;
    case User_Requested_Stop:
      return late ? SolveStatus::kDeadline : SolveStatus::kFailed;
    case Infeasible_Problem_Detected:
      return SolveStatus::kInfeasible;
    case Diverging_Iterates:
      return SolveStatus::kDiverging;
    case Search_Direction_Becomes_Too_Small:
    case Restoration_Failed:
      return SolveStatus::kTooSmallStep;
    case Invalid_Number_Detected:
    case Error_In_Step_Computation:
      return SolveStatus::kBadNumber;
    default:
      return SolveStatus::kFailed;
  }
}

// MUMPS keeps what it works on in variables of its library: two solvers in two threads take turns.
std::mutex& Turns() {
  static std::mutex turns;
  return turns;
}

class IpoptSolver : public Solver {
 public:
  IpoptSolver() : app_(new Ipopt::IpoptApplication(false)), adapter_(new Adapter) {
    app_->Options()->SetIntegerValue("print_level", 0);
    app_->Options()->SetStringValue("sb", "yes");
    app_->Options()->SetStringValue("linear_solver", "mumps");
    app_->Options()->SetStringValue("option_file_name", "");
    app_->RethrowNonIpoptException(false);
    ok_ = app_->Initialize() == Ipopt::Solve_Succeeded;
  }

  ~IpoptSolver() override {
    const std::lock_guard turn(Turns());
    app_ = nullptr;
  }

  void Solve(Program& program, const SolveOptions& options, SolveResult* result) override {
    const std::lock_guard turn(Turns());
    result->status = SolveStatus::kFailed;
    result->iterations = 0;
    result->x.setZero(program.variables());
    result->lambda.setZero(program.constraints());
    result->z_low.setZero(program.variables());
    result->z_high.setZero(program.variables());
    const std::int64_t begin_ns = Now_ns();
    if (ok_) {
      SetOptions(program, options);
      adapter_->Set(&program, options, result);
      const Ipopt::ApplicationReturnStatus status =
          app_->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(adapter_));
      result->status = StatusOf(status, adapter_->late());
      const auto statistics = app_->Statistics();
      if (Ipopt::IsValid(statistics)) {
        result->iterations = statistics->IterationCount();
        statistics->Infeasibilities(result->stationarity, result->infeasibility,
                                    result->complementarity, unused_);
      }
    }
    if (!result->x.allFinite()) result->status = SolveStatus::kBadNumber;
    result->seconds = 1e-9 * static_cast<double>(Now_ns() - begin_ns);
  }

 private:
  void SetOptions(const Program& program, const SolveOptions& options) {
    Ipopt::OptionsList& o = *app_->Options();
    o.SetNumericValue("tol", options.tolerance);
    o.SetNumericValue("acceptable_tol", 100 * options.tolerance);
    o.SetIntegerValue("max_iter", options.max_iterations);
    o.SetStringValue("mu_strategy", "monotone");
    o.SetNumericValue("mu_init", options.initial_barrier);
    o.SetNumericValue("bound_push", 1e-6);
    o.SetNumericValue("bound_frac", 1e-6);
    o.SetNumericValue("slack_bound_push", 1e-6);
    o.SetNumericValue("slack_bound_frac", 1e-6);
    const char* fixed = program.quadratic() ? "yes" : "no";
    o.SetStringValue("hessian_constant", fixed);
    o.SetStringValue("jac_c_constant", fixed);
    o.SetStringValue("jac_d_constant", fixed);
    // Ipopt's own values where they are not the fast ones: options outlive a solve.
    const bool fast = options.fast;
    o.SetStringValue("nlp_scaling_method", fast ? "none" : "gradient-based");
    o.SetStringValue("fast_step_computation", fast ? "yes" : "no");
    o.SetIntegerValue("mumps_pivot_order", fast ? 0 : 7);  // AMD, automatic
    o.SetIntegerValue("mumps_permuting_scaling", fast ? 0 : 7);
    o.SetIntegerValue("mumps_scaling", fast ? 0 : 77);
    o.SetIntegerValue("min_refinement_steps", fast ? 0 : 1);
    o.SetIntegerValue("max_refinement_steps", fast ? 1 : 10);
  }

  Ipopt::SmartPtr<Ipopt::IpoptApplication> app_;
  Ipopt::SmartPtr<Adapter> adapter_;
  bool ok_{false};
  Number unused_{0};
};

}  // namespace

std::unique_ptr<Solver> MakeIpoptSolver() { return std::make_unique<IpoptSolver>(); }

}  // namespace mantle::controller
