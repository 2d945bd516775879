#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/mantle/json.h"

/// A point of a study: one run, or a few of a kind, that a process of its own makes. Points go in,
/// rows come out; who runs them where is an engine's business (study_engine.h).

namespace mantle::tools {

struct StudyPoint {
  std::string kind;    ///< what the process does (study_kinds.h)
  std::string name;    ///< unique in the study, for people
  std::string family;  ///< points that vary one thing
  std::string scene;   ///< file, absolute
  std::vector<std::string> overrides;
  Json options = Json::object();  ///< of the kind
  Json shown = Json::object();    ///< what stands in the row beside the results, as it is

  /// Tells this point from every other: of its scene as it is read, with all the files that it
  /// names, its kind and options, and of this build of the program. Points that give the same row
  /// have the same key.
  std::string Key() const;
};

Json ToJson(const StudyPoint& point);
/// Throws BadInput where a field is missing or of another type.
StudyPoint PointFromJson(const Json& j);

/// What a row begins with, in this order: name, family, ok, reason, overrides, and what is shown.
Json RowOf(const StudyPoint& point);
/// The row of a point that came to nothing.
Json FailedRow(const StudyPoint& point, const std::string& reason);

/// Sixteen hexadecimal digits of the bytes of this program's file.
const std::string& ProgramHash();

/// Program, its hash, processor, operating system, date: what a study's figures depend on.
Json StudyVersions();

/// Folder of references, kept over studies: $XDG_CACHE_HOME/mantle, or ~/.cache/mantle; without a
/// home the folder for temporary files.
std::filesystem::path CacheFolder();

/// Wall clock and CPU time [s] of this process so far.
double CpuSeconds();

}  // namespace mantle::tools
