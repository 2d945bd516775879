#pragma once

#include <Eigen/Core>

#include "controller/options.h"

/// @file
/// Gaits: periodic tensions of the motors. They seed the problem (a pulsed jet has no gradient at
/// rest), extend a plan beyond its end, and swim by themselves as the simplest baseline.

namespace mantle::controller {

/// Tension [N] of one pulse at time t, period T: low, a ramp up over `rise` of the period, high for
/// `hold`, a ramp down over `fall`, low for the rest; t = phase T is where it begins.
double PulseTension(const GaitPulse& pulse, double period_s, double t_s);

/// Of every motor.
void GaitTensions(const Gait& gait, double t_s, Eigen::Ref<Eigen::VectorXd> tensions);

/// The gait with tensions above `low` scaled, and its period.
Gait Scaled(const Gait& gait, double tension_scale, double period_scale);

/// Largest scale whose tensions and slopes no motor's limits cut; infinite where no motor pulses.
double LargestScale(const Gait& gait, const std::vector<MotorLimits>& motors);

}  // namespace mantle::controller
