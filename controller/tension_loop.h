#pragma once

#include "controller/winch_map.h"

namespace mantle::controller {

/// What a TensionLoop knows of its cable and of the bus.
struct TensionLoopOptions {
  double period_s{0.01};
  double stiffness_n_m{500};  ///< K, at the drum
  double damping_n_s_m{2};    ///< D
};

/// What a TensionLoop is told at a SYNC.
struct TensionLoopInput {
  double tension_n{0}, tension_rate_n_s{0};    ///< commanded, at the drum: now, and over the period
  double length_m{0}, length_rate_m_s{0};      ///< lambda - lambda(0), now
  double reported_m{0}, reported_rate_m_s{0};  ///< r, as sampled one period ago
};

/// The tension of one winch's cable, at the rate of SYNC, without a force sensor: from the reel's
/// position and rate as the drive reported them one period ago, and from the length lambda of the
/// cable's path (against its length at rest) that the state estimate gives. With r the reeled
/// length, m the mass of rotor and drum at the cable, T* the commanded tension:
///
///   T = max(0, K e + D e_dot),  e = lambda + r
///   m r_ddot = F - a T - sigma (M_R / s + b T)                      (winch_map.h; F = torque / s)
///
/// Each period:
/// 1. r and its rate are carried from the report to now by that equation, stiction included, with
///    the torque that was commanded meanwhile: no delay is left but the hold of the torque.
/// 2. The commanded tension needs r* = T*/K - lambda and r*_dot = T*_dot/K - lambda_dot.
/// 3. Friction acts against where the reel will go over the period: sigma is the saturation of
///    (mean of its rate now and the rate needed at the period's end + 0.25 (r* - r) / period)
///    over 4 mm/s.
/// 4. F = a T*(mid-period) + friction + k_m m (-lambda_ddot) + k1 (r* - r) + k2 (r*_dot - r_dot).
///
/// The share k_m of the reel's inertia stays below one, since lambda answers to T: a light arm with
/// all of it made up for would be unstable. Gains are of the sampled drum (k1 ~ m / period^2,
/// k2 ~ m / period) and fade out where its frequency on the cable comes near the sampling's limit,
/// sqrt(K / m) period = pi: there only the feed-forward remains. docs/vehicle.md has the figures.
class TensionLoop {
 public:
  /// Throws std::invalid_argument with name, value and bound.
  TensionLoop(const WinchMap& map, const TensionLoopOptions& options);

  /// Forgets the last period: the next report counts as of now.
  void Reset();

  /// Torque for the period that begins now [1/1000 of rated], within the drive's limits. Inputs
  /// that are not finite give the commanded tension without friction; the commanded tension alone
  /// counts as zero where it is not.
  double Update(const TensionLoopInput& in);

  /// The tension now as the last Update reckoned it [N].
  double tension_n() const { return tension_n_; }

 private:
  struct Motion {
    double reeled_m, rate_m_s;
  };
  Motion Predict(const TensionLoopInput& in) const;
  double Force(double permille) const { return permille * map_.permille_nm / map_.metres_per_rad; }

  WinchMap map_;
  TensionLoopOptions options_;
  double k1_n_m_{0}, k2_n_s_m_{0}, inertia_share_{0};
  bool has_past_{false};
  double torque_permille_{0};
  double length_rate_m_s_{0};
  double length_acceleration_m_s2_{0};
  double tension_n_{0};
};

}  // namespace mantle::controller
