#include "model/reel_tensions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mantle::model {
namespace {

// What may be left of a tension, of the largest that the run has seen: increments that are small
// enough by themselves are not where the reel is stiff.
constexpr double kTensionShare = 1e-3;
// A cable's length changes by no more than this times the poses.
constexpr double kMargin = 2.0;

// A taut cable's tension is never zero, which would be a slack one to the matrix.
double NotSlack(double tension_n, bool taut) {
  return taut && tension_n == 0.0 ? std::numeric_limits<double>::min() : tension_n;
}

}  // namespace

ReelTensions::ReelTensions(const Plant& plant)
    : reels_(plant.cable_count()), residual_(VectorX::Zero(plant.cable_count())) {}

void ReelTensions::Begin(const PlantInputs& inputs) {
  given_ = inputs;
  law_ = inputs.cables;
}

const PlantInputs& ReelTensions::Given() {
  for (std::size_t c = 0; c < reels_.size(); ++c) {
    if (!law_[c].reeled) continue;
    given_.cables[c].reeled = false;
    given_.cables[c].tension_n = NotSlack(reels_[c].tension_n, reels_[c].taut);
  }
  return given_;
}

const PlantInputs& ReelTensions::ForMatrix() {
  for (std::size_t c = 0; c < reels_.size(); ++c) {
    reels_[c].in_matrix = law_[c].reeled && reels_[c].taut;
    reels_[c].matrix_tension_n = reels_[c].tension_n;
  }
  return ForMatrixAgain();
}

const PlantInputs& ReelTensions::ForMatrixAgain() {
  for (std::size_t c = 0; c < reels_.size(); ++c) given_.cables[c].reeled = reels_[c].in_matrix;
  return given_;
}

const PlantInputs& ReelTensions::GivenOfMatrix(const PlantInputs& inputs) {
  Begin(inputs);
  for (std::size_t c = 0; c < reels_.size(); ++c) {
    if (!law_[c].reeled) continue;
    given_.cables[c].reeled = false;
    given_.cables[c].tension_n = NotSlack(reels_[c].matrix_tension_n, reels_[c].in_matrix);
  }
  return given_;
}

void ReelTensions::TakeWeights(const Plant& plant, const NewtonMatrix& matrix) {
  for (std::size_t c = 0; c < reels_.size(); ++c) {
    if (reels_[c].in_matrix) reels_[c].weight = matrix.TensionShare(plant, static_cast<int>(c));
  }
}

double ReelTensions::ReelLaw(const PlantWork& work, std::size_t c) const {
  const CableInput& in = law_[c];
  return in.stiffness_n_m * (work.cable_length_m[c] - in.reel_m) +
         in.damping_n_s_m * (work.cable_rate_m_s[c] - in.reel_rate_m_s);
}

bool ReelTensions::Switch(const PlantWork& work) {
  bool changed = false;
  residual_.setZero();
  for (std::size_t c = 0; c < reels_.size(); ++c) {
    if (!law_[c].reeled) continue;
    Reel& reel = reels_[c];
    const double tension_n = ReelLaw(work, c);
    const bool taut = reel.tension_n + reel.weight * (tension_n - reel.tension_n) > 0.0;
    changed = changed || taut != reel.taut;
    reel.taut = taut;
    if (!taut) reel.tension_n = 0.0;
    if (!taut) continue;
    residual_(static_cast<Eigen::Index>(c)) = reel.tension_n - tension_n;
    reel.lacking_n = std::abs(reel.tension_n - tension_n);
  }
  return changed;
}

bool ReelTensions::Correct(double left, double left_m, double s) {
  bool converged = true;
  for (std::size_t c = 0; c < reels_.size(); ++c) {
    Reel& reel = reels_[c];
    if (!law_[c].reeled || !reel.taut) continue;
    const double correction_n = residual_(static_cast<Eigen::Index>(c));
    reel.tension_n -= correction_n;
    const double negligible_n = kTensionShare * std::max(reel.peak_n, std::abs(reel.tension_n));
    const double stiffness_n_m = law_[c].stiffness_n_m + s * law_[c].damping_n_s_m;
    converged = converged && kMargin * stiffness_n_m * left_m <= negligible_n &&
                left * std::max(std::abs(correction_n), reel.lacking_n) <= negligible_n &&
                reel.tension_n >= -negligible_n;
  }
  return converged;
}

bool ReelTensions::MaySwitch(const PlantWork& work, double s, double size_m) const {
  for (std::size_t c = 0; c < reels_.size(); ++c) {
    const CableInput& in = law_[c];
    if (!in.reeled || reels_[c].taut) continue;
    const double change_n = kMargin * (in.stiffness_n_m + s * in.damping_n_s_m) * size_m;
    if (ReelLaw(work, c) + change_n > 0.0) return true;
  }
  return false;
}

void ReelTensions::Accept() {
  for (Reel& reel : reels_) reel.peak_n = std::max(reel.peak_n, reel.tension_n);
}

void ReelTensions::Forget() {
  for (Reel& reel : reels_) reel = {.weight = reel.weight, .peak_n = reel.peak_n};
}

}  // namespace mantle::model
