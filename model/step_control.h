#pragma once

#include <algorithm>
#include <cmath>

namespace mantle::model {

/// Length of error-controlled steps: a PI controller on the ratio of the estimated error to its
/// tolerance (Gustafsson 1991; Hairer & Wanner II, IV.2),
///
///   h' = 0.9 h ratio^(-0.7 / (p+1)) previous^(0.4 / (p+1)),
///
/// p + 1 the power of h in the error. Small growth is not taken, so that an iteration matrix can be
/// kept.
class StepControl {
 public:
  StepControl(double longest_s, int order)
      : longest_s_(longest_s), now_s_(longest_s), power_(order + 1) {}

  double now_s() const { return now_s_; }

  /// A step of h seconds was within tolerance; `ratio` = 0 where nothing is known of its error.
  void Accept(double h, double ratio) {
    if (!(ratio > 0.0)) return;
    ratio = std::max(ratio, kLeastRatio);
    double factor = kSafety * std::pow(ratio, -kIntegral / power_) *
                    std::pow(previous_, kProportional / power_);
    factor = std::clamp(factor, kMostShrink, refused_ ? 1.0 : kMostGrowth);
    previous_ = ratio;
    refused_ = false;
    // A step shortened to land somewhere says no more than that longer ones may do.
    const double next_s = h * factor;
    if (next_s < now_s_ ? h > kLanding * now_s_ : factor > kDeadBand) now_s_ = next_s;
    now_s_ = std::min(now_s_, longest_s_);
  }

  /// A step of h seconds was beyond tolerance.
  void Refuse(double h, double ratio) {
    now_s_ = h * std::max(kMostShrink, kSafety * std::pow(ratio, -1.0 / power_));
    refused_ = true;
  }

  /// Every number that changes, to save and to restore.
  template <typename Number>
  void Walk(Number number) {
    number(now_s_);
    number(previous_);
    double refused = refused_ ? 1.0 : 0.0;
    number(refused);
    refused_ = refused != 0.0;
  }

 private:
  static constexpr double kSafety = 0.9, kIntegral = 0.7, kProportional = 0.4;
  static constexpr double kMostShrink = 0.2, kMostGrowth = 4.0, kDeadBand = 1.2;
  static constexpr double kLeastRatio = 1e-4, kLanding = 0.9;
  double longest_s_, now_s_, power_;
  double previous_{1};
  bool refused_{false};
};

}  // namespace mantle::model
