#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "loop/scene/scene.h"
#include "tools/studies/order_fit.h"
#include "tools/studies/study_point.h"

/// What accuracy costs on a scene in open loop. Families of points vary one thing, each against a
/// reference of its own kind, so that the error is of that thing alone:
///
///   time        integrators and steps     CVODE at 1e-11 on the scene's mesh
///   tolerance   error-controlled steps    the same
///   arms        elements of all arms      four times the scene's elements, the same steps
///   mantle      elements of the mantle    the same for the mantle
///   reduced     basis, order, mantle      the plant on the finest mesh, SDIRK3 at short steps
///               coordinates, quadrature,
///               step
///
/// Every point is also compared with that finest plant: its error in all. From the families' errors
/// the last one, `composed`, puts together settings for errors of 10 % down to 0.03 % of the body
/// length, which are run as well, so that what is recommended has been measured.

namespace mantle::tools {

enum class StudySize { kSmall, kDefault };

/// The scene of a study and what is common to its points.
struct AccuracyScene {
  std::string file;                    ///< absolute
  std::vector<std::string> overrides;  ///< of the command line
  scene::Scene scene;                  ///< with them
  double sample_s{0};                  ///< at which runs are compared
  StudySize size{StudySize::kDefault};
};

/// Reads the scene. Throws BadScene, also where it has no [time].
AccuracyScene PrepareAccuracy(const std::string& file, const std::vector<std::string>& overrides,
                              StudySize size);

/// `elements` times `factor`, one at least.
int Scaled(int elements, double factor);
/// Overrides that multiply the elements of all arms and of the mantle; none where a factor is 1.
std::vector<std::string> MeshOverrides(const scene::Scene& scene, double arms, double mantle);
/// Overrides for fixed steps.
std::vector<std::string> TimeOverrides(const std::string& integrator, double step_s);

/// Where the rows of a scene's study are kept for `mantle run --accuracy`: by the scene as it is
/// with these overrides, and by the build of the program.
std::filesystem::path StudyFile(const scene::Scene& scene);

/// References first, as points of kind "reference"; then all families but the last.
std::vector<StudyPoint> AccuracyReferences(const AccuracyScene& s);
std::vector<StudyPoint> AccuracyPoints(const AccuracyScene& s);
/// Settings put together from the rows of the families.
std::vector<StudyPoint> ComposedPoints(const AccuracyScene& s, const std::vector<Json>& rows);

/// study.json of all rows: orders, front, recommendations.
Json AccuracyReport(const AccuracyScene& s, const std::vector<Json>& references,
                    std::vector<Json> rows);

}  // namespace mantle::tools
