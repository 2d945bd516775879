#include "controller/gait.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mantle::controller {

double PulseTension(const GaitPulse& p, double period_s, double t_s) {
  const double cycles = t_s / period_s - p.phase;
  const double x = cycles - std::floor(cycles);
  const double height = p.high_n - p.low_n;
  if (x < p.rise) return p.low_n + height * x / p.rise;
  if (x < p.rise + p.hold) return p.high_n;
  const double down = x - p.rise - p.hold;
  return down < p.fall ? p.high_n - height * down / p.fall : p.low_n;
}

void GaitTensions(const Gait& gait, double t_s, Eigen::Ref<Eigen::VectorXd> tensions) {
  for (std::size_t i = 0; i < gait.motors.size(); ++i) {
    tensions(static_cast<Eigen::Index>(i)) = PulseTension(gait.motors[i], gait.period_s, t_s);
  }
}

Gait Scaled(const Gait& gait, double tension_scale, double period_scale) {
  Gait scaled = gait;
  scaled.period_s *= period_scale;
  for (GaitPulse& p : scaled.motors) {
    p.high_n = p.low_n + tension_scale * (p.high_n - p.low_n);
  }
  return scaled;
}

double LargestScale(const Gait& gait, const std::vector<MotorLimits>& motors) {
  double scale = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const GaitPulse& p = gait.motors[i];
    const double height = p.high_n - p.low_n;
    if (height <= 0) continue;
    scale = std::min(scale, (motors[i].max_tension_n - p.low_n) / height);
    for (const double share : {p.rise, p.fall}) {
      if (share <= 0) continue;  // a jump is cut anyway
      scale = std::min(scale, motors[i].max_rate_n_s * share * gait.period_s / height);
    }
  }
  return std::max(scale, 0.0);
}

}  // namespace mantle::controller
