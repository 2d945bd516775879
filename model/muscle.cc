#include "model/muscle.h"

#include <array>
#include <cmath>

namespace mantle::model {
namespace {

// Gauss-Legendre on [0, 1], exact to degree 5.
constexpr std::array<double, 3> kPoint = {0.11270166537925831, 0.5, 0.88729833462074169};
constexpr std::array<double, 3> kWeight = {5.0 / 18, 8.0 / 18, 5.0 / 18};

double EnvelopeAt(const MuscleWave& wave, const double* factor, double x) {
  const auto& points = wave.envelope;
  if (points.empty()) return 1.0;
  if (x <= points.front().at_m) return factor[0];
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (x > points[i].at_m) continue;
    const double share = (x - points[i - 1].at_m) / (points[i].at_m - points[i - 1].at_m);
    return factor[i - 1] + share * (factor[i] - factor[i - 1]);
  }
  return factor[points.size() - 1];
}

}  // namespace

Vector3 MuscleMoment(const MuscleWave& wave, const MuscleInput& input, const double* envelopes,
                     double x_m) {
  const double envelope = EnvelopeAt(wave, envelopes + input.first_envelope, x_m);
  const double m =
      input.amplitude_n_m * envelope * std::sin(input.phase_rad - input.wave_number_1_m * x_m);
  return m * wave.axis;
}

Vector3 MeanMuscleMoment(const MuscleWave& wave, const MuscleInput& input, const double* envelopes,
                         double from_m, double to_m) {
  Vector3 mean = Vector3::Zero();
  for (std::size_t k = 0; k < kPoint.size(); ++k) {
    mean += kWeight[k] *
            MuscleMoment(wave, input, envelopes, from_m + kPoint[k] * (to_m - from_m));
  }
  return mean;
}

}  // namespace mantle::model
