#pragma once

#include "tools/studies/study_point.h"

/// What the process of a point does, by its kind. Each returns the point's row; what goes wrong in
/// the run is a row that is not ok, with the reason.

namespace mantle::tools {

/// Throws BadInput where the kind is not known.
Json RunPoint(const StudyPoint& point);

/// "reference": a run that others are compared with, kept in the cache. "accuracy": a run against
/// its references (accuracy_point.cc).
Json RunReferencePoint(const StudyPoint& point);
Json RunAccuracyPoint(const StudyPoint& point);

/// "control": a closed loop with options.controller ("mpc", "converged", or a baseline): the table
/// `control` of its summary.json, with scene, controller, times and how it ended.
Json RunControlPoint(const StudyPoint& point);

}  // namespace mantle::tools
