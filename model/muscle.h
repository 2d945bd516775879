#pragma once

#include "model/inputs.h"
#include "model/lie.h"

/// The moment of a muscle's wave (MuscleWave) at one instant. Both models integrate it against the
/// rate of the strains: Gauss' points on the plant's elements and on the reduced model's pieces.

namespace mantle::model {

/// axis amplitude e(x) sin(phase - wave_number x) [N m], section frame; `envelopes` are
/// PlantInputs::envelopes.
Vector3 MuscleMoment(const MuscleWave& wave, const MuscleInput& input, const double* envelopes,
                     double x_m);

/// Mean over [from_m, to_m], three points of Gauss.
Vector3 MeanMuscleMoment(const MuscleWave& wave, const MuscleInput& input, const double* envelopes,
                         double from_m, double to_m);

}  // namespace mantle::model
