#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "tools/report/run_folder.h"

/// Results in formats of other programs (docs/report.md#exports). Files that are many are handed to
/// `put(name, text)` one by one.

namespace mantle::tools {

using PutFile = std::function<void(const std::string& name, std::string_view text)>;

/// Tables of nodes, spans, mantle, cables and the root, a row for each of them and each shape.
void ExportCsv(const RunRecord& run, const PutFile& put);

/// For ParaView: shapes.pvd, a series in time of shapes/NNNNNN.vtp (VTK XML poly data): surfaces of
/// the bodies with hoop strain, curvature and which body; lines of the cables with their tension.
void ExportVtk(const RunRecord& run, const PutFile& put);

/// For NumPy: arrays over the shapes, the rows of the trajectory and the plans.
std::string ExportNpz(const RunRecord& run);

/// For Blender and slides: one binary glTF 2.0 file; the surfaces move from shape to shape by morph
/// targets, at most `most_shapes` of them. z of the earth is glTF's y.
std::string ExportGlb(const RunRecord& run, std::size_t most_shapes);

/// For Foxglove: an MCAP file with the surfaces as foxglove.SceneUpdate and every column of the
/// trajectory as one message a row, both in JSON.
std::string ExportMcap(const RunRecord& run);

}  // namespace mantle::tools
