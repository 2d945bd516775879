#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model/simulation.h"

/// What runs of a scene are compared by, and how far two of them are apart.

namespace mantle::tools {

/// One instant of a run.
struct StudyFrame {
  double time_s{0};
  model::Vector3 root_m{model::Vector3::Zero()};   ///< the earth's frame
  model::Vector3 heading{model::Vector3::Zero()};  ///< e3 of the root in the earth's frame
  std::vector<model::Vector3> tips_m;              ///< of the arms
  double volume_m3{0};                             ///< enclosed by the mantle; 0 without one
  double energy_j{0};                              ///< kinetic and elastic
};

/// A run at its samples.
struct StudyPath {
  double body_length_m{1};
  bool held{false};  ///< the root does not move freely
  std::vector<StudyFrame> frames;
};

/// Adds a sample of a run.
void AddFrame(const model::Sample& sample, StudyPath* path);

/// The path as text that reads back to the same bits, and back. ReadStudyPath throws BadInput where
/// the file is no such text or ends too early.
std::string StudyPathText(const StudyPath& path);
StudyPath ReadStudyPath(const std::filesystem::path& file);

/// An error over a run: the largest, and at the last instant that both have.
struct ErrorPair {
  double largest{0}, final{0};
};

/// How far a run is from its reference, over the instants that both have (equal to a nanosecond; a
/// run whose steps are longer than the samples' interval has fewer).
struct PathErrors {
  ErrorPair root;         ///< distance, in body lengths
  ErrorPair tip;          ///< distance of the worst tip, in body lengths
  ErrorPair heading_rad;  ///< angle between the directions of e3
  ErrorPair volume;       ///< relative to the reference's largest change of volume
  ErrorPair energy;       ///< relative to the reference's largest energy
  int frames{0};          ///< compared
};

/// Throws std::invalid_argument where the two have no instant but the first in common, or not as
/// many arms.
PathErrors ComparePaths(const StudyPath& path, const StudyPath& reference);

/// The one figure of a study: the larger of root's and tips' largest error; of a held mantle
/// without arms the volume's.
double Headline(const PathErrors& errors, const StudyPath& reference);

}  // namespace mantle::tools
