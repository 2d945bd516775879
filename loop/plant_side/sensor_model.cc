#include "loop/plant_side/sensor_model.h"

#include "reduced/outputs.h"

namespace mantle::loop {
namespace {

constexpr double kSameTime_s = 1e-9;

}  // namespace

SensorModel::SensorModel(const ReducedModel& model, const controller::SensorOptions& options)
    : model_(model), options_(options), random_(static_cast<std::uint64_t>(options.seed)) {
  const int n = model.velocity_count();
  deviation_.setZero(2 * n);
  if (model.root_free()) {
    deviation_.head<3>().setConstant(options.attitude_rad);
    deviation_.segment<3>(3).setConstant(options.position_m);
    deviation_.segment<3>(n).setConstant(options.angular_velocity_rad_s);
    deviation_.segment<3>(n + 3).setConstant(options.velocity_m_s);
  }
  for (std::size_t a = 0; a < model.arms.size(); ++a) {
    const int first = 6 + model.arm_first(static_cast<int>(a)), size = model.arms[a].size();
    deviation_.segment(first, size).setConstant(options.strain);
    deviation_.segment(n + first, size).setConstant(options.strain_rate);
  }
  if (model.mantle) {
    const int first = 6 + model.mantle_first(), size = model.mantle->size;
    deviation_.segment(first, size) = options.mantle * model.mantle->basis.scale;
    deviation_.segment(n + first, size) = options.mantle_rate * model.mantle->basis.scale;
  }
  std::normal_distribution<double> normal;
  bias_.setZero(2 * n);
  for (double& b : bias_) b = options.bias * normal(random_);
  bias_.array() *= deviation_.array();
  noise_ = bias_;
}

ReducedState SensorModel::WithNoise(const ReducedState& truth) {
  std::normal_distribution<double> normal;
  for (Eigen::Index i = 0; i < noise_.size(); ++i) {
    noise_(i) = bias_(i) + deviation_(i) * normal(random_);
  }
  ReducedState measured = truth;
  reduced::MoveState(truth, noise_, &measured);
  return measured;
}

double SensorModel::MeasureCable(double length_m) {
  if (options_.cable_m == 0) return length_m;
  return length_m + options_.cable_m * std::normal_distribution<double>()(random_);
}

double SensorModel::MeasureCableRate(double rate_m_s) {
  if (options_.cable_rate_m_s == 0) return rate_m_s;
  return rate_m_s + options_.cable_rate_m_s * std::normal_distribution<double>()(random_);
}

std::optional<ReducedState> SensorModel::Measure(const ReducedState& truth) {
  if (options_.perfect()) return truth;
  std::uniform_real_distribution<double> uniform;
  const bool lost = uniform(random_) < options_.loss;
  ReducedState measured = WithNoise(truth);
  waiting_.push_back(lost ? std::nullopt : std::optional<ReducedState>(std::move(measured)));
  taken_s_.push_back(truth.time_s);
  std::optional<ReducedState> arrives;
  while (!taken_s_.empty() && taken_s_.front() <= truth.time_s - options_.delay_s + kSameTime_s) {
    if (waiting_.front()) arrives = std::move(waiting_.front());
    waiting_.pop_front();
    taken_s_.pop_front();
  }
  return arrives;
}

}  // namespace mantle::loop
