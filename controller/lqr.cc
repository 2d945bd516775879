#include "controller/lqr.h"

#include <algorithm>
#include <cmath>

#include "controller/stage_cost.h"
#include "model/dense_algebra.h"
#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

using Eigen::MatrixXd;
using model::Matrix3;
using model::Product;
using model::Solve;
using model::SolveSymmetric;
using model::TransposeProduct;

constexpr int kDoublings = 9;           // 512 control periods: far beyond every mode's time
constexpr double kPretension_n = 0.02;  // of the nominal cables, so that none is slack
// A decision that costs nothing would have no smallest value: effort and rate are at least these.
constexpr double kLeastEffort = 1e-6, kLeastRate = 1e-6;
constexpr double kRate_s = 0.05;           // of the reference's turn rate by differences
constexpr double kMostOffsetLength = 0.5;  // of the place, in body lengths: linear up to there
constexpr int kTipIterations = 3;

// Rows (and columns) of the halves that are kept.
MatrixXd Kept(const MatrixXd& m, int first, bool columns) {
  const Eigen::Index n = m.rows() / 2, k = n - first;
  MatrixXd rows(2 * k, m.cols());
  rows << m.middleRows(first, k), m.middleRows(n + first, k);
  if (!columns) return rows;
  MatrixXd both(2 * k, 2 * k);
  both << rows.middleCols(first, k), rows.middleCols(n + first, k);
  return both;
}

ReducedState NominalState(const ReducedModel& model, const ControlOptions& options) {
  ReducedState s = InitialState(model);
  s.q.setZero();
  s.v.setZero();
  if (!model.root_free()) return s;
  if (const auto* path = std::get_if<PathTask>(&options.goal)) s.v(5) = path->speed_m_s;
  if (const auto* cruise = std::get_if<CruiseTask>(&options.goal)) {
    s.v(5) = cruise->speed_m_s;
  }
  return s;
}

// C^T D C of the stage cost at a state, the mean velocity's weight on the velocity.
MatrixXd StateWeight(const ReducedModel& model, const ControlOptions& options,
                     const Reference& reference, const ReducedState& s) {
  const int n = model.velocity_count();
  ControlOptions weights = options;
  weights.cost.velocity += options.cost.mean_velocity;
  StageCost cost(model, weights, reference);
  VectorX residual = VectorX::Zero(cost.rows());
  MatrixXd jacobian = MatrixXd::Zero(cost.rows(), 2 * n);
  cost.Evaluate(s, &residual, &jacobian);
  return TransposeProduct(jacobian, cost.weights().asDiagonal() * jacobian);
}

// (x, c) with x = A x + B c but for the root's pose, and `rows` x = unit demands.
MatrixXd SteadyState(const MatrixXd& a, const MatrixXd& b, int pose, const MatrixXd& rows) {
  const Eigen::Index n = a.rows(), free = n - pose;
  MatrixXd m = MatrixXd::Zero(free + 2, free + 2);
  m.topLeftCorner(free, free) = a.bottomRightCorner(free, free) - MatrixXd::Identity(free, free);
  m.topRightCorner(free, 2) = b.bottomRows(free);
  m.bottomLeftCorner(2, free) = rows.rightCols(free);
  MatrixXd demand = MatrixXd::Zero(free + 2, 2);
  demand.bottomRows(2).setIdentity();
  MatrixXd out = MatrixXd::Zero(n + 2, 2);
  out.bottomRows(free + 2) = model::SolveLeastNorm(m, demand);
  return out;
}

}  // namespace

Riccati SolveRiccati(const MatrixXd& a, const MatrixXd& b, const MatrixXd& q, const MatrixXd& r,
                     int doublings) {
  const MatrixXd identity = MatrixXd::Identity(a.rows(), a.cols());
  const auto gain = [&](const MatrixXd& value) -> MatrixXd {
    const MatrixXd to_input = TransposeProduct(b, value);
    return SolveSymmetric(r + Product(to_input, b), Product(to_input, a));
  };
  MatrixXd step = a, g = Product(b, SolveSymmetric(r, b.transpose())), h = q;
  Riccati out;
  out.gain = gain(h);
  for (int i = 0; i < doublings; ++i) {
    const MatrixXd coupled = identity + Product(g, h);
    const MatrixXd whole = Solve(coupled, step);
    const MatrixXd next_g = g + Product(Product(step, Solve(coupled, g)), step.transpose());
    const MatrixXd next_h = h + Product(TransposeProduct(step, h), whole);
    step = Product(step, whole);
    g = 0.5 * (next_g + next_g.transpose());
    h = 0.5 * (next_h + next_h.transpose());
    const MatrixXd next = gain(h);
    out.change = (next - out.gain).norm() / std::max(next.norm(), 1e-300);
    out.gain = next;
  }
  out.value = h;
  return out;
}

SteeringModel LineariseSteering(const ReducedModel& model, const reduced::StepSettings& step,
                                const ControlOptions& options, const Reference& reference,
                                const Eigen::Matrix2Xd& directions, double effort_factor) {
  SteeringModel out;
  out.period_s = options.period_s;
  out.first = model.root_free() ? 0 : 6;
  const ReducedState nominal = NominalState(model, options);
  ReducedState after = nominal;
  VectorX tensions(model.input_count());
  for (Eigen::Index i = 0; i < tensions.size(); ++i) {
    tensions(i) = options.motors[i].min_tension_n + kPretension_n;
  }
  reduced::StepJacobian jacobian(model);
  Propagator propagator(model, step);
  const reduced::StepOutcome outcome =
      propagator.Step(nominal, out.period_s, tensions, &after, &jacobian);
  if (!outcome.ok) {
    throw model::BadRobot(std::string("control: the linear-quadratic regulator cannot linearise "
                                      "the straight cruise: ") +
                          outcome.cause);
  }
  const MatrixXd a = Kept(jacobian.state, out.first, true);
  const MatrixXd b = 0.5 * Product(Kept(jacobian.input, out.first, false), directions.transpose());
  const Eigen::Index n = a.rows();
  const double h = out.period_s;
  const Eigen::Matrix2d metric = PullMetric(directions);
  out.a = MatrixXd::Identity(n + 2, n + 2);
  out.a.topLeftCorner(n, n) = a;
  out.a.topRightCorner(n, 2) = b;
  out.b = MatrixXd::Zero(n + 2, 2);
  out.b.topRows(n) = 0.5 * h * b;
  out.b.bottomRows(2) = h * Eigen::Matrix2d::Identity();
  out.q = MatrixXd::Zero(n + 2, n + 2);
  out.q.topLeftCorner(n, n) =
      h * Kept(StateWeight(model, options, reference, nominal), out.first, true);
  out.q.bottomRightCorner(2, 2) =
      h * std::max(effort_factor * options.cost.effort, kLeastEffort) * metric;
  out.r = h * std::max(effort_factor * options.cost.rate, kLeastRate) * metric;
  MatrixXd rows = MatrixXd::Zero(2, n);
  if (reference.has_tip()) {
    const int arm = reference.arm(), at = model.arm_first(arm);
    Eigen::Matrix3Xd by(3, model.arms[arm].size());
    Eigen::Ref<Eigen::Matrix3Xd> view(by);
    EvaluateTip(model.arms[arm], nominal.q.data() + at, &view);
    const Matrix3 to_base = model.arms[arm].mount.rotation.conjugate().toRotationMatrix();
    rows.middleCols(6 - out.first + at, by.cols()) = (to_base * by).bottomRows<2>();
  } else {
    rows(0, n / 2 + 1) = 1;  // e3 turns towards e1 with omega_2, towards e2 with -omega_1
    rows(1, n / 2) = -1;
  }
  out.steady = SteadyState(a, b, 6 - out.first, rows);
  return out;
}

SteeringRegulator::SteeringRegulator(const ReducedModel& model, const reduced::StepSettings& step,
                                     const ControlOptions& options, const Reference& reference,
                                     const Eigen::Matrix2Xd& directions, const BaselineGains& gains)
    : model_(model),
      reference_(reference),
      gains_(gains),
      directions_(directions),
      bias_to_pull_(PullMetric(directions).inverse()),
      aim_(model, reference),
      linear_(LineariseSteering(model, step, options, reference, directions, gains.lqr_effort)),
      riccati_(SolveRiccati(linear_.a, linear_.b, linear_.q, linear_.r, kDoublings)),
      target_(InitialState(model)),
      difference_(VectorX::Zero(2 * model.velocity_count())),
      kept_(VectorX::Zero(linear_.a.rows())),
      steady_(VectorX::Zero(linear_.a.rows())),
      most_offset_m_(kMostOffsetLength * model.body_length_m) {}

void SteeringRegulator::Start() {
  pull_.setZero();
  held_.setZero();
  fresh_ = true;
}

// The target's shape and rates for a steady demand; what it does not bear on stays as it is.
void SteeringRegulator::SetSteady(const Vector2& demand, const ReducedState& state) {
  const int n = model_.velocity_count(), k = linear_.half(n);
  steady_.noalias() = linear_.steady * demand;
  target_.q = steady_.segment(6 - linear_.first, n - 6);
  target_.v.tail(k) = steady_.segment(k, k);
  if (model_.mantle) {
    const int at = model_.mantle_first(), size = model_.mantle->size;
    target_.q.segment(at, size) = state.q.segment(at, size);
    target_.v.segment(6 + at, size) = state.v.segment(6 + at, size);
  }
}

Vector2 SteeringRegulator::PathTarget(const ReducedState& state) {
  const double ahead = state.time_s + gains_.lookahead_s;
  const ReferencePoint now = reference_.At(state.time_s), aim = reference_.At(ahead);
  const Vector3 turn =
      (reference_.At(ahead + kRate_s).direction - reference_.At(ahead - kRate_s).direction) /
      (2 * kRate_s);
  // The least turn from the present attitude: roll stays as it is.
  const Matrix3 r = state.root.rotation.toRotationMatrix();
  const Vector3 target = r.transpose() * aim.direction;
  target_.root.rotation =
      state.root.rotation * Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), target);
  target_.root.position = state.root.position;
  if (reference_.has_position()) {
    Vector3 offset = now.position - state.root.position;
    offset -= offset.dot(now.direction) * now.direction;
    const double size = offset.norm();
    if (size > most_offset_m_) offset *= most_offset_m_ / size;
    target_.root.position += offset;
  }
  SetSteady((target_.root.rotation.conjugate() * turn).head<2>(), state);
  target_.v(5) = state.v(5);  // along the track the gait works
  return steady_.tail<2>();
}

// The steady bend whose tip is at the reference: the linear one, corrected for its kinematics.
Vector2 SteeringRegulator::TipTarget(const ReducedState& state) {
  const double ahead = state.time_s + gains_.lookahead_s;
  const Vector2 target = aim_.TipTarget(state.root, ahead);
  const Vector2 rate = (aim_.TipTarget(state.root, ahead + kRate_s) - target) / kRate_s;
  const int arm = reference_.arm(), at = model_.arm_first(arm), n = model_.velocity_count();
  const auto& mount = model_.arms[arm].mount;
  target_.root = state.root;
  Vector2 demand = target;
  for (int i = 0; i < kTipIterations; ++i) {
    SetSteady(demand, state);
    const model::Pose tip = EvaluateTip(model_.arms[arm], target_.q.data() + at, nullptr);
    const Vector3 way = mount.rotation.conjugate() * (tip.position - mount.position);
    demand += target - way.tail<2>();
  }
  SetSteady(demand, state);
  const Vector2 pull = steady_.tail<2>();
  target_.v.tail(n - 6).noalias() = linear_.steady.middleRows(6 - linear_.first, n - 6) * rate;
  return pull;
}

Vector2 SteeringRegulator::Target(const ReducedState& state) {
  return reference_.has_tip() ? TipTarget(state) : PathTarget(state);
}

Vector2 SteeringRegulator::Update(const ReducedState& state, double dt_s,
                                  const Disturbance& disturbance, double most_n) {
  const int n = model_.velocity_count(), k = linear_.half(n), first = linear_.first;
  Vector2 steady = Target(state);
  steady.noalias() -= bias_to_pull_ * (directions_ * disturbance.bias_n);
  StateDifference(target_, state, difference_);
  if (model_.root_free()) {
    const Vector3 water = state.root.rotation.conjugate() * disturbance.current_m_s;
    difference_.segment<2>(n + 3) -= water.head<2>();  // along the track the gait works
  }
  kept_.head(k) = difference_.segment(first, k);
  kept_.segment(k, k) = difference_.segment(n + first, k);
  if (fresh_) held_ = steady;
  kept_.tail<2>() = pull_ - held_;
  Vector2 rate;
  rate.noalias() = -riccati_.gain * kept_;
  if (!rate.allFinite()) return pull_;
  pull_ += steady - held_ + dt_s * rate;
  const double size = pull_.norm();
  if (size > most_n) pull_ *= most_n / size;
  held_ = steady;
  fresh_ = false;
  return pull_;
}

}  // namespace mantle::controller
