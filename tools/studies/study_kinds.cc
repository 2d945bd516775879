#include "tools/studies/study_kinds.h"

#include <fmt/format.h>

#include <stdexcept>

#include "loop/scene/scene.h"
#include "tools/mantle/bad_input.h"
#include "tools/studies/effects_study.h"
#include "tools/studies/stability_study.h"

namespace mantle::tools {

Json RunPoint(const StudyPoint& point) {
  try {
    if (point.kind == "reference") return RunReferencePoint(point);
    if (point.kind == "accuracy") return RunAccuracyPoint(point);
    if (point.kind == "stability") return RunStabilityPoint(point);
    if (point.kind == "control") return RunControlPoint(point);
    if (point.kind == "workload") return RunWorkloadPoint(point);
    if (point.kind == "effects") return RunEffectsPoint(point);
  } catch (const scene::BadScene& error) {
    return FailedRow(point, error.what());
  } catch (const BadInput& error) {
    return FailedRow(point, error.what());
  } catch (const std::invalid_argument& error) {
    return FailedRow(point, error.what());
  }
  throw BadInput(fmt::format("a point of kind \"{}\": this program knows none such", point.kind));
}

}  // namespace mantle::tools
