#pragma once

#include <string>
#include <vector>

#include "tools/studies/study_point.h"

/// Hard cases: every integrator at steps from 0.1 to 50 ms on scenes that are hard for a named
/// reason (scenes/hard/). A run
///
///   holds      reaches the end within what physics allows: all figures finite, no energy that no
///              load has done work for, momentum kept where nothing acts from outside, nowhere
///              further from the reference than two body lengths
///   told       goes beyond one of these bounds, and its own warnings say that the steps do not
///              resolve the motion
///   refused    did not begin or did not reach the end, with a reason that names the cause
///   slow       was stopped by the study, after kMostCpu_s of CPU time
///   violates   none of these: a silent wrong answer
///
/// A case passes with an integrator where nothing violates.

namespace mantle::tools {

/// Steps of a study [s].
std::vector<double> StabilitySteps(bool small);
inline constexpr const char* kStabilityIntegrators[] = {"sdirk2", "sdirk3", "backward_euler", "rk4",
                                                        "cvode"};

/// Largest energy without work, of the run's energies; the model warns of as much (energy_drift).
inline constexpr double kEnergyWithoutWork = 0.05;
/// Largest change of momentum where nothing acts from outside, of the largest that the energy could
/// hold.
inline constexpr double kMomentumChange = 0.1;
/// Furthest from the reference, in body lengths.
inline constexpr double kFurthest = 2.0;
/// Error within which a run is as the reference, in body lengths: what is stated of every case.
inline constexpr double kAsReference = 0.02;
/// CPU time of one run [s].
inline constexpr double kMostCpu_s = 3.0;
/// The step of the default settings (SDIRK2), [s].
inline constexpr double kDefaultStep_s = 0.01;

/// Scene files of a folder (*.toml, sorted), or the file itself. Throws BadInput where there is
/// none.
std::vector<std::string> HardScenes(const std::string& scene_or_folder);

/// References of the scenes, and a point for every scene and integrator.
std::vector<StudyPoint> StabilityReferences(const std::vector<std::string>& scenes,
                                            const std::vector<std::string>& overrides);
std::vector<StudyPoint> StabilityPoints(const std::vector<std::string>& scenes,
                                        const std::vector<std::string>& overrides,
                                        const std::vector<double>& steps);

/// The row of such a point: `runs`, one per step, each with step_s, verdict, reason, error, created
/// (energy without work), momentum (its change), cpu_s; and of all the largest step that holds with
/// every shorter one, and why the next one does not.
Json RunStabilityPoint(const StudyPoint& point);

/// study.json of the rows: per integrator counts and steps, cases that no run reaches, share of the
/// cases that the default settings reach, refusals by cause.
Json StabilityReport(const std::vector<std::string>& overrides, const std::vector<Json>& references,
                     const std::vector<Json>& rows);

/// One row per run, for the CSV.
std::vector<Json> StabilityRuns(const std::vector<Json>& rows);

}  // namespace mantle::tools
