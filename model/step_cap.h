#pragma once

#include <algorithm>

namespace mantle::model {

/// The longest step that is tried: halved where a step fails, doubled again once it has held. A
/// step that fails right after it has grown is the one that does not hold, and the next attempt to
/// grow waits twice as long, so that what cannot be stepped over costs few rejected steps.
class StepCap {
 public:
  explicit StepCap(double longest_s) : longest_s_(longest_s), now_s_(longest_s) {}

  double now_s() const { return now_s_; }

  void Fail(double tried_s) {
    now_s_ = 0.5 * tried_s;
    patience_ = grown_ ? std::min(2 * patience_, kMostPatience) : 1;
    left_ = patience_;
    grown_ = false;
  }

  void Hold() {
    grown_ = false;
    if (now_s_ >= longest_s_ || --left_ > 0) return;
    now_s_ = std::min(longest_s_, 2.0 * now_s_);
    left_ = patience_;
    grown_ = true;
  }

  /// Every number of it but the longest step, to save and to restore.
  template <typename Number>
  void Walk(Number number) {
    number(now_s_);
    const auto count = [&](int& n) {
      double x = n;
      number(x);
      n = static_cast<int>(x);
    };
    count(patience_);
    count(left_);
    int grown = grown_ ? 1 : 0;
    count(grown);
    grown_ = grown != 0;
  }

 private:
  static constexpr int kMostPatience = 64;
  double longest_s_, now_s_;
  int patience_{1}, left_{1};
  bool grown_{false};
};

}  // namespace mantle::model
