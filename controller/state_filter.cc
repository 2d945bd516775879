#include "controller/state_filter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

// What the model may miss in a second: deviations of the rates' random walk.
constexpr double kTurn_rad_s = 0.04, kSpeed_m_s = 1e-2, kBend_1_m = 1.0, kStretch = 1e-2;
constexpr double kMantle = 8.0;  // of the mantle's size: its pulses excite more than its shapes
// What a reduced state says of the plant at best: places, and rates.
constexpr double kPlace_m = 5e-4, kAngle_rad = 2e-3, kPlaceRate_m_s = 5e-3, kAngleRate_rad_s = 2e-2;
constexpr double kBendFloor_1_m = 0.05, kStretchFloor = 2e-3, kMantleFloor = 0.2;
constexpr double kRates_1_s = 5.0;  // of coordinates, over the coordinates'
constexpr double kMostAcceleration_m_s2 = 0.1;
constexpr double kMostCurrent_m_s = 2.0;
// What a pulse of the plant's has that the model's has not looks like a current of 20 mm/s: only
// over several pulses does the model keep up with the plant. So much is R larger for places and the
// root's attitude, and for all else, where a current is estimated.
constexpr double kSlowPlace = 10, kSlow = 30;
constexpr double kFirstBias_n = 0.02, kFirstAcceleration_m_s2 = 2e-3, kFirstCurrent_m_s = 0.1;

// Quantile of the chi-square distribution with n degrees of freedom at z standard deviations of a
// normal one (E. B. Wilson, M. M. Hilferty, Proc. Natl. Acad. Sci. 17, 1931).
double ChiSquareQuantile(double n, double z) {
  const double spread = 2.0 / (9.0 * n);
  return n * std::pow(1.0 - spread + z * std::sqrt(spread), 3);
}

}  // namespace

StateFilter::StateFilter(const ReducedModel& model, const reduced::StepSettings& step,
                         const EstimatorOptions& options, const SensorOptions& sensors,
                         const std::vector<MotorLimits>& limits)
    : propagator_(model, step),
      size_(2 * model.velocity_count()),
      motors_(model.input_count()),
      extra_(options.current ? 6 : 3),
      bound_(options.gate > 0 ? ChiSquareQuantile(size_, options.gate)
                              : std::numeric_limits<double>::infinity()),
      state_(InitialState(model)),
      next_(state_),
      jacobian_(model),
      disturbance_(motors_),
      most_(VectorX::Zero(motors_)) {
  for (int i = 0; i < motors_; ++i) most_(i) = kMostBias * limits[i].max_tension_n;
  const int n = model.velocity_count(), all = size_ + motors_ + extra_;
  const bool free = model.root_free();
  process_.setZero(all);
  noise_.setZero(size_);
  start_.setZero(all);
  const double spread = 1 + sensors.bias * sensors.bias;
  const double distrust = std::pow(options.model_noise, 2);
  const auto set = [&](int at, int count, double floor, double rate_floor, double deviation,
                       double rate_deviation, double missed) {
    noise_.segment(at, count).setConstant(floor * floor + spread * deviation * deviation);
    noise_.segment(n + at, count)
        .setConstant(rate_floor * rate_floor + spread * rate_deviation * rate_deviation);
    process_.segment(n + at, count).setConstant(distrust * missed * missed);
  };
  set(0, 3, kAngle_rad, kAngleRate_rad_s, sensors.attitude_rad, sensors.angular_velocity_rad_s,
      free ? kTurn_rad_s : 0.0);
  set(3, 3, kPlace_m, kPlaceRate_m_s, sensors.position_m, sensors.velocity_m_s,
      free ? kSpeed_m_s : 0.0);
  for (std::size_t a = 0; a < model.arms.size(); ++a) {
    const reduced::ReducedArm& arm = model.arms[a];
    const int first = 6 + model.arm_first(static_cast<int>(a));
    const std::vector<bool> bends = reduced::BendingCoordinates(arm);
    for (std::size_t i = 0; i < bends.size(); ++i) {
      const double floor = bends[i] ? kBendFloor_1_m : kStretchFloor;
      set(first + static_cast<int>(i), 1, floor, kRates_1_s * floor, sensors.strain,
          sensors.strain_rate, bends[i] ? kBend_1_m : kStretch);
    }
  }
  if (model.mantle) {
    // The coordinates are orthonormal in the mass: one size says the same of each.
    const double size = model.mantle->basis.scale.maxCoeff();
    for (int i = 0; i < model.mantle->size; ++i) {
      const double scale = model.mantle->basis.scale(i);
      set(6 + model.mantle_first() + i, 1, kMantleFloor * size, kRates_1_s * kMantleFloor * size,
          sensors.mantle * scale, sensors.mantle_rate * scale, kMantle * size);
    }
  }
  if (options.current) {  // learn from drifts alone
    noise_.head<6>() *= std::pow(kSlowPlace, 2);
    noise_.tail(size_ - 6) *= std::pow(kSlow, 2);
  }
  start_.head(size_) = noise_;
  if (!free) {
    start_.head<6>().setZero();
    start_.segment<6>(n).setZero();
  }
  if (options.disturbance) {
    process_.segment(size_, motors_).setConstant(std::pow(options.tension_walk_n, 2));
    start_.segment(size_, motors_).setConstant(std::pow(kFirstBias_n, 2));
    if (free) {
      process_.segment<3>(size_ + motors_).setConstant(std::pow(options.acceleration_walk_m_s2, 2));
      start_.segment<3>(size_ + motors_).setConstant(std::pow(kFirstAcceleration_m_s2, 2));
    }
  }
  if (options.current) {
    process_.tail<3>().setConstant(std::pow(options.current_walk_m_s, 2));
    start_.tail<3>().setConstant(std::pow(kFirstCurrent_m_s, 2));
    by_current_.setZero(size_, 3);
  }
  error_.setZero(all);
  innovation_.setZero(size_);
  p_.setZero(all, all);
  f_.setZero(size_, all);
  moved_ = f_;
  s_.setZero(size_, size_);
  gain_ = f_;
  Start(state_);
}

void StateFilter::Start(const ReducedState& state) {
  state_ = state;
  disturbance_ = Disturbance(motors_);
  propagator_.SetDisturbance(disturbance_);
  p_ = start_.asDiagonal();
  refused_in_turn_ = 0;
  refused_ = restarts_ = 0;
  surprise_ = 0;
}

// The state is the measurement's, and as uncertain; what the model misses it goes on missing.
void StateFilter::Restart(const ReducedState& measured) {
  const double now_s = state_.time_s;
  state_ = measured;
  state_.time_s = now_s;
  p_.topRows(size_).setZero();
  p_.leftCols(size_).setZero();
  p_.diagonal().head(size_) = start_.head(size_);
  refused_in_turn_ = 0;
  ++restarts_;
}

void StateFilter::Predict(double t_s, const Eigen::Ref<const VectorX>& tensions) {
  const double h = t_s - state_.time_s;
  const bool flows = extra_ == 6;
  if (propagator_.Step(state_, h, tensions, &next_, &jacobian_, flows ? &by_current_ : nullptr)
          .ok) {
    std::swap(state_, next_);
    const int n = size_ / 2;
    f_.leftCols(size_) = jacobian_.state;
    f_.middleCols(size_, motors_) = jacobian_.input;
    f_.rightCols(extra_).setZero();
    if (flows) f_.rightCols<3>() = by_current_;
    f_.block<3, 3>(n + 3, size_ + motors_) = h * model::Matrix3::Identity();
    moved_.noalias() = f_ * p_;
    p_.topLeftCorner(size_, size_).noalias() = moved_ * f_.transpose();
    const int rest = motors_ + extra_;
    p_.topRightCorner(size_, rest) = moved_.rightCols(rest);
    p_.bottomLeftCorner(rest, size_) = moved_.rightCols(rest).transpose();
  }
  p_.diagonal() += h * process_;
  state_.time_s = t_s;
}

bool StateFilter::Correct(const ReducedState& measured) {
  StateDifference(state_, measured, innovation_);
  s_ = p_.topLeftCorner(size_, size_);
  s_.diagonal() += noise_;
  gain_ = p_.topRows(size_);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(s_);
  if (factor.info() != Eigen::Success || !innovation_.allFinite()) return false;
  // With S = L L^T and Y = L^-1 P_x.: K = Y^T L^-1, P <- P - Y^T Y.
  factor.matrixL().solveInPlace(innovation_);
  surprise_ = innovation_.squaredNorm() / bound_;
  if (surprise_ > 1.0) {
    ++refused_;
    if (++refused_in_turn_ <= kMostRefused) return false;
    Restart(measured);
    return true;
  }
  refused_in_turn_ = 0;
  factor.matrixL().solveInPlace(gain_);
  error_.noalias() = gain_.transpose() * innovation_;
  p_.noalias() -= gain_.transpose() * gain_;
  MoveState(state_, error_.head(size_), &next_);
  next_.time_s = state_.time_s;
  std::swap(state_, next_);
  disturbance_.bias_n =
      (disturbance_.bias_n + error_.segment(size_, motors_)).cwiseMax(-most_).cwiseMin(most_);
  const model::Vector3 a = disturbance_.acceleration_m_s2 + error_.segment<3>(size_ + motors_);
  disturbance_.acceleration_m_s2 =
      a.cwiseMax(-kMostAcceleration_m_s2).cwiseMin(kMostAcceleration_m_s2);
  if (extra_ == 6) {
    const model::Vector3 c = disturbance_.current_m_s + error_.tail<3>();
    disturbance_.current_m_s = c.cwiseMax(-kMostCurrent_m_s).cwiseMin(kMostCurrent_m_s);
  }
  propagator_.SetDisturbance(disturbance_);
  return true;
}

}  // namespace mantle::controller
