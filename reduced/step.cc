#include "reduced/step.h"

#include <algorithm>
#include <cmath>

namespace mantle::reduced {

using model::PlantInputs;

namespace {

constexpr double kGamma2 = 0.29289321881345254;  // 1 - 1/sqrt(2): L-stable SDIRK2 (Alexander 1977)
// Newton: a contraction above this makes a new matrix (Broyden's first corrections may overshoot
// where the jet turns round, and a matrix costs as much as several residuals); increments growing
// that much give up.
constexpr double kPoorContraction = 2.0;
constexpr double kDivergence = 1e6;
constexpr double kAssumedContraction = 0.1;
constexpr double kAssumedCurvature = 10.0;  // with a new matrix the error squares, times this
constexpr double kLargestShare = 0.8;  // of the last step that Broyden's correction may add again
constexpr int kHalvings = 8;           // of a step into a shape that cannot be
constexpr int kUpdates = 12;           // kept

struct Scheme {
  int stages;
  double gamma, a21;
};
Scheme SchemeOf(StepScheme scheme) {
  if (scheme == StepScheme::kBackwardEuler) return {1, 1.0, 0.0};
  return {2, kGamma2, 1.0 - kGamma2};
}

}  // namespace

double FirstStageTime(StepScheme scheme) { return SchemeOf(scheme).gamma; }

StepJacobian::StepJacobian(const ReducedModel& model) {
  const int n = model.velocity_count();
  state.setZero(2 * n, 2 * n);
  input.setZero(2 * n, model.input_count());
  step.setZero(2 * n);
}

StepStages::StepStages(const ReducedModel& model) {
  for (VectorX& y : increment) y.setZero(model.velocity_count());
}

StepWork::StepWork(const ReducedModel& model)
    : evaluation_(model), jacobians_(model), lu_(model.velocity_count()) {
  const int n = model.velocity_count();
  const int columns = PanelColumns(2 * n + model.input_count() + 1);
  for (Stage& s : stages_) {
    for (VectorX* v : {&s.y, &s.y_known, &s.y_rate, &s.v_known, &s.acceleration}) v->setZero(n);
    s.state = InitialState(model);
    for (Panel* m : {&s.y_by, &s.rate_by}) m->setZero(n, columns);
    s.root.setZero(6, columns);
  }
  matrix_.setZero(n, n);
  weighted_.setZero(n, n);
  left_.setZero(n, n + 6);
  right_.setZero(n + 6, columns);
  increment_.setZero(n);
  last_.setZero(n);
  steps_.setZero(n, kUpdates);
  norms_.setZero(kUpdates);
  root_rows_.setZero(6, columns);
  scale_.setOnes(n);
  scale_.segment<3>(3) /= model.plant.body_length_m;
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    scale_.segment(6 + model.arm_first(a), model.arms[a].size())
        .setConstant(model.plant.robot.arms[a].length_m);
  }
  if (model.mantle) {
    scale_.segment(6 + model.mantle_first(), model.mantle->size) =
        model.mantle->basis.scale.cwiseInverse();
  }
}

/// One step in the making.
class StepSolver {
 public:
  StepSolver(const ReducedModel& model, const StepSettings& settings, double h,
             const ReducedState& from, const PlantInputs& first, const PlantInputs& last,
             StepWork* work)
      : model_(model),
        settings_(settings),
        scheme_(SchemeOf(settings.scheme)),
        h_(h),
        sigma_(1.0 / (scheme_.gamma * h)),
        from_(from),
        inputs_{&first, &last},
        work_(*work),
        n_(model.velocity_count()),
        free_(model.plant.root_free()) {}

  bool Solve(bool derivatives, const StepStages* guess, StepOutcome* outcome) {
    for (int i = 0; i < scheme_.stages; ++i) {
      StepWork::Stage& s = work_.stages_[i];
      if (i == 0) {
        s.y_known.setZero();
        s.v_known = from_.v;
      } else {
        const StepWork::Stage& p = work_.stages_[0];
        s.y_known = (h_ * scheme_.a21) * p.y_rate;
        s.v_known = from_.v + (h_ * scheme_.a21) * p.acceleration;
      }
      if (guess != nullptr) {
        s.y = guess->increment[i];
      } else {  // the rate goes on as it was
        s.y = s.y_known + (1.0 / sigma_) * (i == 0 ? s.v_known : work_.stages_[0].y_rate);
      }
      if (!SolveStage(i, derivatives, outcome)) return false;
      if (!derivatives) continue;
      Correct(i);
      if (!Differentiate(i)) return Fail(outcome, "the stage's matrix is singular");
    }
    return true;
  }

  void Remember(StepStages* stages) const {
    for (int i = 0; i < scheme_.stages; ++i) stages->increment[i] = work_.stages_[i].y;
    stages->known = true;
  }

  void Finish(ReducedState* to) const {
    const StepWork::Stage& s = work_.stages_[scheme_.stages - 1];
    to->time_s = from_.time_s + h_;
    to->root = s.state.root;
    to->root.rotation.normalize();
    to->q = s.state.q;
    to->v = s.state.v;
  }

  void FinishJacobian(StepJacobian* out) {
    const StepWork::Stage& s = work_.stages_[scheme_.stages - 1];
    const int inputs = model_.input_count();
    const auto split = [&](const auto& from, int row) {
      const auto rows = from.rows();
      out->state.middleRows(row, rows) = from.leftCols(2 * n_);
      out->input.middleRows(row, rows) = from.middleCols(2 * n_, inputs);
      out->step.segment(row, rows) = from.col(2 * n_ + inputs);
    };
    // the root's increment in the body frame of its end
    work_.root_rows_.setZero();
    if (free_) AddProduct(s.jr, s.y_by.topRows<6>(), work_.root_rows_);
    split(work_.root_rows_, 0);
    split(s.y_by.bottomRows(n_ - 6), 6);
    split(s.root, n_);
    split(s.rate_by.bottomRows(n_ - 6), n_ + 6);
    if (free_) out->state.topLeftCorner<6, 6>() += Adjoint(model::Inverse(Moved(s)));
    out->state.block(6, 6, n_ - 6, n_ - 6).diagonal().array() += 1.0;  // q = q_0 + y
  }

 private:
  static Pose Moved(const StepWork::Stage& s) { return model::ExpSE3(s.y.head<6>()); }

  bool Fail(StepOutcome* outcome, const char* cause) const {
    outcome->ok = false;
    outcome->body = model_.plant.robot.name.c_str();
    outcome->cause = cause;
    return false;
  }

  // y -> state, rates, acceleration.
  void Unpack(int i) {
    StepWork::Stage& s = work_.stages_[i];
    s.y_rate = sigma_ * (s.y - s.y_known);
    s.state.q = from_.q + s.y.tail(n_ - 6);
    s.state.v = s.y_rate;
    if (free_) {
      const model::PoseAndTwist moved = model::ExpAndTangent(s.y.head<6>(), s.y_rate.head<6>());
      s.state.root = from_.root * moved.pose;
      s.state.v.head<6>() = moved.twist;
    } else {
      s.state.root = inputs_[InputIndex(i)]->root_pose;
      s.state.v.head<6>() = inputs_[InputIndex(i)]->root_twist;
    }
    s.acceleration = sigma_ * (s.state.v - s.v_known);
    if (!free_) s.acceleration.head<6>() = inputs_[InputIndex(i)]->root_acceleration;
  }

  int InputIndex(int i) const { return scheme_.stages == 1 ? 1 : i; }

  // Jacobians at the last evaluation, and A = K H_g + (D + sigma M) H_v factored. `weighted_` keeps
  // D + sigma M.
  void Factor(int i, bool with_inputs) {
    StepWork::Stage& s = work_.stages_[i];
    ReducedJacobians& j = work_.jacobians_;
    Linearise(model_, s.state, s.acceleration, *inputs_[InputIndex(i)], with_inputs,
              &work_.evaluation_, &j);
    work_.weighted_ = j.damping + sigma_ * j.mass;
    work_.matrix_.rightCols(n_ - 6) =
        j.stiffness.rightCols(n_ - 6) + sigma_ * work_.weighted_.rightCols(n_ - 6);
    if (free_) {
      const Vector6 theta = s.y.head<6>();
      const Vector6 twist = s.state.v.head<6>();
      // Jr, and D = d(Jr(theta) x)/d theta = -Jr (d(Jr^-1 y)/d theta) at y = Jr x
      const model::EvenTangentInverse even(theta);
      s.jr = model::TangentOperator(theta);
      s.jr_rate.noalias() = -s.jr * (even.Derivative(twist) - 0.5 * model::SmallAdjoint(twist));
      const Matrix6 by_rate = sigma_ * s.jr + s.jr_rate;
      work_.matrix_.leftCols<6>().noalias() = j.stiffness.leftCols<6>().lazyProduct(s.jr);
      work_.matrix_.leftCols<6>().noalias() += work_.weighted_.leftCols<6>().lazyProduct(by_rate);
    } else {
      work_.matrix_.leftCols<6>().setZero();
      work_.matrix_.topRows<6>().setZero();
      work_.matrix_.topLeftCorner<6, 6>().setIdentity();
    }
    work_.lu_.Factor(work_.matrix_);
  }

  // Newton's method with one matrix and Broyden's updates of its inverse (Kelley, Iterative Methods
  // for Linear and Nonlinear Equations, 1995, ch. 7); the matrix is made anew where that contracts
  // poorly.
  bool SolveStage(int i, bool derivatives, StepOutcome* outcome) {
    StepWork::Stage& s = work_.stages_[i];
    double previous = 0;
    int updates = 0;
    for (int k = 0; k < settings_.max_iterations; ++k) {
      Unpack(i);
      // A shape that cannot be: go back half way, a few times.
      for (int half = 0; !Evaluate(i, outcome); ++half) {
        if (k == 0 || half == kHalvings) return false;
        outcome->ok = true;
        work_.last_ *= 0.5;
        s.y -= work_.last_;
        have_matrix_ = false;
        Unpack(i);
      }
      const bool fresh = !have_matrix_;
      if (fresh) {
        Factor(i, false);
        have_matrix_ = true;
        updates = 0;
      }
      VectorX& step = work_.increment_;
      step = -work_.evaluation_.residual;
      if (!free_) step.head<6>().setZero();
      work_.lu_.Solve(&step);
      step.array() *= work_.scale_.array();
      for (int j = 0; j + 1 < updates; ++j) {
        step += work_.steps_.col(j + 1) * (work_.steps_.col(j).dot(step) / work_.norms_(j));
      }
      if (updates > 0) {
        const double share = work_.steps_.col(updates - 1).dot(step) / work_.norms_(updates - 1);
        if (share < kLargestShare) step /= 1.0 - share;
      }
      const double size = step.cwiseAbs().maxCoeff();
      if (!std::isfinite(size) || size > kDivergence) {
        return Fail(outcome, "Newton's iteration diverges; take a shorter step");
      }
      work_.last_.array() = step.array() / work_.scale_.array();
      s.y += work_.last_;
      ++outcome->iterations;
      const double contraction = fresh ? std::min(kAssumedContraction, kAssumedCurvature * size)
                                       : (k > 0 ? size / previous : kAssumedContraction);
      if (contraction < 1.0 && size * contraction < settings_.tolerance * (1.0 - contraction)) {
        Unpack(i);
        return !derivatives || Evaluate(i, outcome);
      }
      if (updates == work_.steps_.cols() || (k > 0 && size > kPoorContraction * previous)) {
        have_matrix_ = false;
      } else {
        work_.steps_.col(updates) = step;
        work_.norms_(updates++) = step.squaredNorm();
      }
      previous = size;
    }
    return Fail(outcome, "Newton's iteration does not converge; take a shorter step");
  }

  bool Evaluate(int i, StepOutcome* outcome) {
    StepWork::Stage& s = work_.stages_[i];
    const ReducedFailure failure = EvaluateResidual(model_, s.state, s.acceleration,
                                                    *inputs_[InputIndex(i)], &work_.evaluation_);
    if (!failure) return true;
    outcome->ok = false;
    outcome->body = failure.body;
    outcome->cause = failure.cause;
    return false;
  }

  // One more Newton step, with the matrix of the derivatives, which are taken before it.
  void Correct(int i) {
    StepWork::Stage& s = work_.stages_[i];
    Factor(i, true);
    VectorX& step = work_.increment_;
    step = -work_.evaluation_.residual;
    if (!free_) step.head<6>().setZero();
    work_.lu_.Solve(&step);
    s.y += step;
    Unpack(i);
  }

  // d(y, y_rate, v) of stage i by (zeta_0, q_0, v_0, u, h).
  bool Differentiate(int i) {
    StepWork::Stage& s = work_.stages_[i];
    const ReducedJacobians& j = work_.jacobians_;
    const int inputs = model_.input_count();
    const int at_h = 2 * n_ + inputs;
    const int rest = n_ - 6;
    const double inv_h = 1.0 / h_;
    const double ha = h_ * scheme_.a21;
    const StepWork::Stage& p = work_.stages_[0];
    Panel& x = s.y_by;

    // v_known = v_0 [+ h a21 a_1, a_1 = sigma (v_1 - v_0)]
    const double by_velocity = i > 0 ? sigma_ * (1.0 - sigma_ * ha) : sigma_;
    x.setZero();
    if (free_) {
      x.leftCols<6>() = -j.stiffness.leftCols<6>().lazyProduct(Adjoint(model::Inverse(Moved(s))));
    }
    x.middleCols(6, rest) = -j.stiffness.rightCols(rest);
    x.middleCols(n_, n_) = by_velocity * j.mass;
    x.middleCols(2 * n_, inputs) = -j.input;
    // dv = -v/h dh and da = sigma dv - a/h dh at fixed y, y_known, v_known; h a_1 is fixed
    VectorX& column = work_.increment_;
    const auto root_held = [&](VectorX& v) -> VectorX& {
      if (!free_) v.head<6>().setZero();
      return v;
    };
    column = inv_h * s.state.v;
    x.col(at_h) = work_.weighted_.lazyProduct(root_held(column));
    column = inv_h * s.acceleration;
    x.col(at_h) += j.mass.lazyProduct(root_held(column));
    if (i > 0) {
      // y_known = h a21 y_rate_1 and v_known, in their root and other rows (there v = y_rate)
      auto root_rate = work_.right_.topRows<6>();
      root_rate.setZero();
      work_.right_.middleRows<6>(6).setZero();
      if (free_) {
        work_.root_rows_ = ha * p.rate_by.topRows<6>();
        work_.root_rows_.col(at_h) += scheme_.a21 * p.y_rate.head<6>();
        AddProduct(s.jr, work_.root_rows_, root_rate);
        work_.right_.middleRows<6>(6) = p.root;
      }
      work_.right_.bottomRows(rest) = p.rate_by.bottomRows(rest);
      work_.left_.leftCols<6>() = sigma_ * work_.weighted_.leftCols<6>();
      work_.left_.middleCols<6>(6) = (sigma_ * sigma_ * ha) * j.mass.leftCols<6>();
      work_.left_.rightCols(rest) =
          (sigma_ * ha) * (work_.weighted_.rightCols(rest) + sigma_ * j.mass.rightCols(rest));
      AddProduct(work_.left_, work_.right_, x);
      x.col(at_h) +=
          (sigma_ * scheme_.a21) * work_.weighted_.rightCols(rest).lazyProduct(p.y_rate.tail(rest));
    }
    if (!free_) {
      x.topRows<6>().setZero();
      x.middleCols(n_, 6).setZero();
    }
    work_.lu_.Solve(&x);
    if (!std::isfinite(x.sum())) return false;  // as soon as one entry is not
    s.rate_by = sigma_ * x;
    s.rate_by.col(at_h) -= inv_h * s.y_rate;
    if (i > 0) {
      s.rate_by -= (sigma_ * ha) * p.rate_by;
      s.rate_by.col(at_h) -= (sigma_ * scheme_.a21) * p.y_rate;
    }
    s.root.setZero();
    if (free_) {
      AddProduct(s.jr, s.rate_by.topRows<6>(), s.root);
      AddProduct(s.jr_rate, x.topRows<6>(), s.root);
    }
    return true;
  }

  const ReducedModel& model_;
  const StepSettings& settings_;
  const Scheme scheme_;
  const double h_, sigma_;
  const ReducedState& from_;
  const PlantInputs* inputs_[2];
  StepWork& work_;
  const int n_;
  const bool free_;
  bool have_matrix_{false};
};

StepOutcome TakeStep(const ReducedModel& model, const StepSettings& settings, double h,
                     const ReducedState& from, const PlantInputs& first, const PlantInputs& last,
                     StepWork* work, ReducedState* to, StepJacobian* jacobian, StepStages* stages) {
  StepOutcome outcome;
  if (from.q.size() != model.coordinate_count() || from.v.size() != model.velocity_count()) {
    outcome.ok = false;
    outcome.body = model.plant.robot.name.c_str();
    outcome.cause = "the state has the wrong size for this model";
    return outcome;
  }
  if (!(h > 0.0) || !std::isfinite(h)) {
    outcome.ok = false;
    outcome.body = model.plant.robot.name.c_str();
    outcome.cause = "the step must be positive";
    return outcome;
  }
  StepSolver solver(model, settings, h, from, first, last, work);
  const StepStages* const guess = stages != nullptr && stages->known ? stages : nullptr;
  const bool solved = solver.Solve(jacobian != nullptr, guess, &outcome);
  if (stages != nullptr) stages->known = false;
  if (!solved) return outcome;
  if (stages != nullptr) solver.Remember(stages);
  solver.Finish(to);
  if (jacobian != nullptr) solver.FinishJacobian(jacobian);
  return outcome;
}

}  // namespace mantle::reduced
