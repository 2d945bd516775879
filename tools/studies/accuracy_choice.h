#pragma once

#include <string>
#include <vector>

#include "loop/scene/scene.h"

/// Which mesh and steps a commanded accuracy takes: `mantle run --accuracy`.

namespace mantle::tools {

/// What was chosen, and what it will err by.
struct AccuracyChoice {
  std::vector<std::string> overrides;  ///< of the scene: elements, integrator, step
  double expected{0};  ///< largest error of root and tips, in body lengths; mesh and time together
  std::string text;    ///< one line: the settings, the error expected, and how it is known
};

/// A share of the body length from "1%", "0.5 %" or "0.005". Throws BadInput where it is none in
/// (0, 1).
double ParseAccuracy(const std::string& text);

/// Chooses the cheapest settings whose expected error is at most `target`:
///
/// - from this scene's study (`mantle study accuracy`), where it is in the cache: the cheapest
/// point
///   of the plant whose error against the finest plant is within the target;
/// - else from a pilot of at most `budget_s` of CPU time: a reference with twice the elements and
///   short SDIRK3 steps, some meshes and some steps against it, and the pair of them that they
///   suggest, which is run as well. Over the whole run where that fits, else over its first tenth
///   (and one period of the actuation at least), the errors then growing on by the power of time
///   that they grew by within the pilot.
///
/// To what a pilot measures against its reference comes the reference's own error, a third of what
/// the scene's elements and the reference are apart (second order), and half as much again for what
/// is not seen. Throws BadInput where even the finest settings cannot be promised, with what can.
AccuracyChoice ChooseAccuracy(const std::string& file, const std::vector<std::string>& overrides,
                              double target, double budget_s = 10.0);

}  // namespace mantle::tools
