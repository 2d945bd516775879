#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "model/newton_matrix.h"
#include "model/stepper.h"

/// SUNDIALS CVODE (variable-order BDF, error-controlled) on the semi-discrete equations, as the
/// accuracy reference. State vector: per pose a quaternion (w, x, y, z) and a position, then the
/// shape, then v, then the works of all loads as quadratures (not in the error test). Krylov linear
/// solver, preconditioned by the same O(N) matrix as the implicit steps.
///
/// Preconditioner: with delta q ~ zeta (body increments) the system (I - gamma J) dy = r reads
///   zeta - gamma delta_eta = r_zeta,  M delta_eta - gamma (K zeta + D delta_eta) = M r_eta,
/// so (M/gamma^2 - K - D/gamma) (gamma delta_eta) = (M r_eta + gamma K r_zeta)/gamma; K r_zeta is a
/// directional difference of f.

namespace mantle::model {
namespace {

constexpr int kPose = 7;
constexpr long kMaxInternalSteps = 2000000;
constexpr double kProbe = 1e-7;
constexpr double kSameTime_s = 1e-12;

class CvodeStepper final : public Stepper {
 public:
  CvodeStepper(const Plant& plant, const StepperSettings& settings)
      : plant_(plant),
        settings_(settings),
        matrix_(plant),
        work_(plant),
        jacobian_work_(plant),
        state_(InitialState(plant)),
        jacobian_state_(state_),
        probe_(state_),
        quadrature_(plant),
        shape_at_(kPose * plant.pose_count()),
        velocity_at_(shape_at_ + 3 * plant.shape_count()),
        work_at_(velocity_at_ + plant.velocity_size()),
        size_(work_at_ + static_cast<int>(quadrature_.names().size()) + 1) {
    acceleration_.setZero(plant.velocity_size());
    jacobian_acceleration_ = acceleration_;
    increment_.setZero(plant.velocity_size());
    image_.setZero(plant.velocity_size());
    if (SUNContext_Create(nullptr, &context_) != 0)
      throw std::runtime_error("SUNDIALS: no context");
    y_ = N_VNew_Serial(size_, context_);
    tolerance_ = N_VNew_Serial(size_, context_);
    memory_ = CVodeCreate(CV_BDF, context_);
    solver_ = SUNLinSol_SPGMR(y_, SUN_PREC_LEFT, 20, context_);
    double* tol = N_VGetArrayPointer(tolerance_);
    std::fill(tol, tol + size_, settings.absolute_tolerance);
    std::fill(tol + work_at_, tol + size_, 1e30);
    const double length = plant.body_length_m;
    for (int p = 0; p < plant.pose_count(); ++p) {
      for (int k = 4; k < kPose; ++k) tol[kPose * p + k] *= length;
    }
    N_VConst(0.0, y_);
    Check(CVodeInit(memory_, &CvodeStepper::Rhs, 0.0, y_), "CVodeInit");
    Check(CVodeSVtolerances(memory_, settings.relative_tolerance, tolerance_), "CVodeSVtolerances");
    Check(CVodeSetUserData(memory_, this), "CVodeSetUserData");
    Check(CVodeSetLinearSolver(memory_, solver_, nullptr), "CVodeSetLinearSolver");
    Check(CVodeSetPreconditioner(memory_, &CvodeStepper::Setup, &CvodeStepper::Solve),
          "CVodeSetPreconditioner");
    Check(CVodeSetMaxNumSteps(memory_, kMaxInternalSteps), "CVodeSetMaxNumSteps");
    Check(CVodeSetErrFile(memory_, nullptr), "CVodeSetErrFile");
  }

  ~CvodeStepper() override {
    CVodeFree(&memory_);
    SUNLinSolFree(solver_);
    N_VDestroy(y_);
    N_VDestroy(tolerance_);
    SUNContext_Free(&context_);
  }
  CvodeStepper(const CvodeStepper&) = delete;
  CvodeStepper& operator=(const CvodeStepper&) = delete;

  StepStatus Step(double h, PlantState* state, EnergyAccount* energy) override {
    stop_s_ = state->time_s + h;
    account_ = energy != nullptr;
    if (restart_ || std::abs(state->time_s - reached_s_) > kSameTime_s) {
      Pack(*state);
      Check(CVodeReInit(memory_, state->time_s, y_), "CVodeReInit");
      restart_ = false;
    }
    double* y = N_VGetArrayPointer(y_);
    const std::vector<double> works(y + work_at_, y + size_);
    Check(CVodeSetStopTime(memory_, stop_s_), "CVodeSetStopTime");
    double t = state->time_s;
    const int flag = CVode(memory_, stop_s_, y_, &t, CV_NORMAL);
    long steps = 0, iterations = 0, failures = 0;
    CVodeGetNumSteps(memory_, &steps);
    CVodeGetNumNonlinSolvIters(memory_, &iterations);
    CVodeGetNumErrTestFails(memory_, &failures);
    counters_.steps += steps - seen_steps_;
    counters_.newton_iterations += iterations - seen_iterations_;
    counters_.rejected += failures - seen_failures_;
    seen_steps_ = steps;
    seen_iterations_ = iterations;
    seen_failures_ = failures;
    if (flag < 0) {
      restart_ = true;
      return {false, fmt::format("CVODE stopped at t = {:.6g} s with {} {}", t,
                                 CVodeGetReturnFlagName(flag), reason_)};
    }
    reached_s_ = stop_s_;
    Unpack(y, stop_s_, &state_);
    state->pose = state_.pose;
    state->shape = state_.shape;
    state->velocity = state_.velocity;
    state->time_s = stop_s_;
    Evaluate(stop_s_, state, &work_);
    SolveAcceleration(plant_, inputs_, &work_, &acceleration_);
    if (energy != nullptr) {
      std::vector<double> total = energy->work_j();
      for (std::size_t i = 0; i < total.size(); ++i) total[i] += y[work_at_ + i] - works[i];
      energy->Restore(total, energy->dissipated_j() + y[size_ - 1] - works.back());
    }
    return {};
  }

  const VectorX& acceleration() const override { return acceleration_; }
  const StepCounters& counters() const override { return counters_; }
  void Restart() override { restart_ = true; }
  void CrossBreakpoint() override { Restart(); }
  std::string SaveMemory() const override {
    throw BadRobot("checkpoint: CVODE's history is not saved; use another integrator");
  }
  void RestoreMemory(const std::string&) override {
    throw BadRobot("checkpoint: CVODE's history is not saved; use another integrator");
  }

 private:
  void Check(int flag, const char* what) {
    if (flag < 0) throw std::runtime_error(fmt::format("SUNDIALS: {} failed ({})", what, flag));
    if (flag == 0 && std::string_view(what) == "CVodeReInit") {
      seen_steps_ = seen_iterations_ = seen_failures_ = 0;
    }
  }

  void Pack(const PlantState& state) {
    double* y = N_VGetArrayPointer(y_);
    for (int p = 0; p < plant_.pose_count(); ++p) {
      const Pose& g = state.pose[p];
      double* at = y + kPose * p;
      at[0] = g.rotation.w();
      for (int k = 0; k < 3; ++k) {
        at[1 + k] = g.rotation.vec()(k);
        at[4 + k] = g.position(k);
      }
    }
    for (int j = 0; j < plant_.shape_count(); ++j) {
      for (int k = 0; k < 3; ++k) y[shape_at_ + 3 * j + k] = state.shape[j](k);
    }
    for (int i = 0; i < plant_.velocity_size(); ++i) y[velocity_at_ + i] = state.velocity(i);
  }

  void Unpack(const double* y, double t, PlantState* state) const {
    state->time_s = t;
    for (int p = 0; p < plant_.pose_count(); ++p) {
      const double* at = y + kPose * p;
      state->pose[p].rotation = Eigen::Quaterniond(at[0], at[1], at[2], at[3]).normalized();
      state->pose[p].position = Vector3(at[4], at[5], at[6]);
    }
    for (int j = 0; j < plant_.shape_count(); ++j) {
      state->shape[j] = Eigen::Map<const Vector3>(y + shape_at_ + 3 * j);
    }
    state->velocity = Eigen::Map<const VectorX>(y + velocity_at_, plant_.velocity_size());
  }

  bool Evaluate(double t, PlantState* state, PlantWork* work) {
    const bool from_left = t >= stop_s_ - kSameTime_s;
    EvaluateInputs(plant_, t, from_left, &inputs_);
    if (settings_.input_hook) settings_.input_hook(t, from_left, &inputs_);
    ImposeRoot(plant_, inputs_, state);
    ++counters_.evaluations;
    const EvaluationFailure failure = EvaluateForces(plant_, *state, inputs_, work);
    if (failure) reason_ = failure.Message();
    return !failure;
  }

  static int Rhs(double t, N_Vector y, N_Vector rate, void* self) {
    return static_cast<CvodeStepper*>(self)->RhsOf(t, N_VGetArrayPointer(y),
                                                   N_VGetArrayPointer(rate));
  }

  int RhsOf(double t, const double* y, double* rate) {
    Unpack(y, t, &state_);
    if (!Evaluate(t, &state_, &work_)) return 1;  // recoverable: CVODE tries a smaller step
    SolveAcceleration(plant_, inputs_, &work_, &acceleration_);
    for (int p = 0; p < plant_.pose_count(); ++p) {
      const Vector6 eta = TwistOf(p);
      const Eigen::Quaterniond& q = state_.pose[p].rotation;
      const Eigen::Quaterniond qd = q * Eigen::Quaterniond(0, eta(0), eta(1), eta(2));
      const Vector3 v = q * eta.tail<3>();
      double* at = rate + kPose * p;
      at[0] = 0.5 * qd.w();
      for (int k = 0; k < 3; ++k) {
        at[1 + k] = 0.5 * qd.vec()(k);
        at[4 + k] = v(k);
      }
    }
    const int shape = 3 * plant_.shape_count();
    for (int i = 0; i < shape; ++i) {
      rate[shape_at_ + i] = state_.velocity(plant_.velocity_size() - shape + i);
    }
    for (int i = 0; i < plant_.velocity_size(); ++i) rate[velocity_at_ + i] = acceleration_(i);
    std::fill(rate + work_at_, rate + size_, 0.0);
    if (account_) {
      quadrature_.EvaluatePowers(plant_, state_, inputs_, work_, acceleration_);
      std::copy(quadrature_.power_w().begin(), quadrature_.power_w().end(), rate + work_at_);
      rate[size_ - 1] = quadrature_.dissipation_w();
    }
    return 0;
  }

  // Chain twist of a pose (relative ones in frozen coupling).
  Vector6 TwistOf(int pose) const {
    if (pose == 0) return state_.velocity.head<6>();
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      const int i = pose - plant_.ArmPose(a, 0);
      if (i > plant_.rods[a].element_count()) continue;
      return i == 0 ? work_.twist[a][0]
                    : Vector6(state_.velocity.segment<6>(plant_.ArmVelocity(a, i)));
    }
    return Vector6::Zero();
  }

  static int Setup(double t, N_Vector y, N_Vector, int, int* current, double gamma, void* self) {
    *current = 1;
    return static_cast<CvodeStepper*>(self)->SetupOf(t, N_VGetArrayPointer(y), gamma);
  }

  int SetupOf(double t, const double* y, double gamma) {
    Unpack(y, t, &jacobian_state_);
    if (!Evaluate(t, &jacobian_state_, &jacobian_work_)) return 1;
    jacobian_inputs_ = inputs_;
    ++counters_.factorisations;
    SolveAcceleration(plant_, inputs_, &jacobian_work_, &jacobian_acceleration_);
    const bool ok = matrix_.Factor(plant_, jacobian_state_, inputs_, jacobian_work_,
                                   jacobian_acceleration_, 1.0 / gamma, 0.0);
    return ok ? 0 : 1;
  }

  static int Solve(double, N_Vector, N_Vector, N_Vector r, N_Vector z, double gamma, double, int,
                   void* self) {
    return static_cast<CvodeStepper*>(self)->SolveOf(N_VGetArrayPointer(r), N_VGetArrayPointer(z),
                                                     gamma);
  }

  int SolveOf(const double* r, double* z, double gamma) {
    std::copy(r, r + size_, z);
    // r_zeta
    increment_.setZero();
    const auto zeta_of = [&](int pose, int at) {
      const Eigen::Quaterniond& q = jacobian_state_.pose[pose].rotation;
      const double* p = r + kPose * pose;
      increment_.segment<3>(at) =
          2.0 * (q.conjugate() * Eigen::Quaterniond(p[0], p[1], p[2], p[3])).vec();
      increment_.segment<3>(at + 3) = q.conjugate() * Vector3(p[4], p[5], p[6]);
    };
    ForEachPose(zeta_of);
    const int shape = 3 * plant_.shape_count();
    for (int i = 0; i < shape; ++i)
      increment_(plant_.velocity_size() - shape + i) = r[shape_at_ + i];
    // M r_eta + gamma K r_zeta
    const Eigen::Map<const VectorX> r_eta(r + velocity_at_, plant_.velocity_size());
    velocity_ = r_eta;
    // A root that is not free is given: its rows are the identity, and no body feels its residual.
    if (!plant_.root_free()) velocity_.head<6>().setZero();
    ApplyMass(plant_, jacobian_work_, velocity_, &image_);
    const double norm = increment_.norm();
    if (norm > 0) {
      const double eps = kProbe / norm;
      Retract(plant_, jacobian_state_, eps * increment_, &probe_);
      probe_.velocity = jacobian_state_.velocity;
      ImposeRoot(plant_, jacobian_inputs_, &probe_);
      if (EvaluateForces(plant_, probe_, jacobian_inputs_, &work_)) return 1;
      image_ += (gamma / eps) * (work_.force - jacobian_work_.force);
    }
    if (!plant_.root_free()) image_.head<6>().setZero();
    image_ /= gamma;
    matrix_.Solve(plant_, &image_);  // gamma delta_eta
    velocity_ = image_ / gamma;
    if (!plant_.root_free()) velocity_.head<6>() = r_eta.head<6>();
    increment_ += image_;
    for (int i = 0; i < plant_.velocity_size(); ++i) z[velocity_at_ + i] = velocity_(i);
    const auto unmap = [&](int pose, int at) {
      const Eigen::Quaterniond& q = jacobian_state_.pose[pose].rotation;
      const Vector3 w = increment_.segment<3>(at);
      const Eigen::Quaterniond dq = q * Eigen::Quaterniond(0, w(0), w(1), w(2));
      // the part along q (its norm) has no dynamics: it passes through
      const double* p = r + kPose * pose;
      const double along = q.w() * p[0] + q.vec().dot(Vector3(p[1], p[2], p[3]));
      double* out = z + kPose * pose;
      out[0] = 0.5 * dq.w() + along * q.w();
      for (int k = 0; k < 3; ++k) out[1 + k] = 0.5 * dq.vec()(k) + along * q.vec()(k);
      const Vector3 v = q * increment_.segment<3>(at + 3);
      for (int k = 0; k < 3; ++k) out[4 + k] = v(k);
    };
    ForEachPose(unmap);
    for (int i = 0; i < shape; ++i)
      z[shape_at_ + i] = increment_(plant_.velocity_size() - shape + i);
    return 0;
  }

  // Poses that carry unknowns of their own, with the place of their velocity.
  template <typename Visit>
  void ForEachPose(Visit visit) const {
    if (plant_.root_free()) visit(0, 0);
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      for (int i = 1; i <= plant_.rods[a].element_count(); ++i) {
        visit(plant_.ArmPose(a, i), plant_.ArmVelocity(a, i));
      }
    }
  }

  const Plant& plant_;
  StepperSettings settings_;
  NewtonMatrix matrix_;
  PlantWork work_, jacobian_work_;
  PlantInputs inputs_, jacobian_inputs_;
  PlantState state_, jacobian_state_, probe_;
  EnergyAccount quadrature_;
  int shape_at_, velocity_at_, work_at_, size_;
  VectorX acceleration_, jacobian_acceleration_, increment_, image_, velocity_;
  SUNContext context_{nullptr};
  N_Vector y_{nullptr}, tolerance_{nullptr};
  void* memory_{nullptr};
  SUNLinearSolver solver_{nullptr};
  StepCounters counters_;
  std::string reason_;
  long seen_steps_{0}, seen_iterations_{0}, seen_failures_{0};
  double stop_s_{0}, reached_s_{std::numeric_limits<double>::quiet_NaN()};
  bool restart_{true}, account_{false};
};

}  // namespace

std::unique_ptr<Stepper> MakeCvodeStepper(const Plant& plant, const StepperSettings& settings) {
  return std::make_unique<CvodeStepper>(plant, settings);
}

}  // namespace mantle::model
