#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "tools/report/export_formats.h"
#include "tools/report/surface.h"

namespace mantle::tools {
namespace {

// VTK's readers take "nan" in ASCII arrays.
void Number(double v, std::string* to) {
  fmt::format_to(std::back_inserter(*to), "{} ", static_cast<float>(v));
}

template <typename Fill>
std::string DataArray(const char* type, const char* name, int components, Fill fill) {
  std::string text = fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">\n", type,
      name, components);
  fill(&text);
  return text + "\n</DataArray>\n";
}

// Cells as VTK counts them: their points, then where each one ends.
std::string Cells(const char* kind, const std::vector<std::vector<std::size_t>>& cells) {
  return fmt::format("<{}>\n", kind) +
         DataArray("Int64", "connectivity", 1,
                   [&](std::string* to) {
                     for (const auto& cell : cells) {
                       for (const std::size_t p : cell) *to += fmt::format("{} ", p);
                     }
                   }) +
         DataArray("Int64", "offsets", 1,
                   [&](std::string* to) {
                     std::size_t end = 0;
                     for (const auto& cell : cells) *to += fmt::format("{} ", end += cell.size());
                   }) +
         fmt::format("</{}>\n", kind);
}

std::string PolyData(const ShapeTelemetry& m) {
  const Surface s = SurfaceOf(m);
  const std::size_t surface_points = s.position.size();
  const std::size_t points = surface_points + m.cable_position.size();
  std::vector<std::vector<std::size_t>> lines, triangles;
  std::vector<double> tension(surface_points, std::nan(""));
  std::size_t at = surface_points;
  for (std::size_t c = 0; c < m.cable_points.size(); ++c) {
    std::vector<std::size_t>& line = lines.emplace_back();
    for (std::int32_t i = 0; i < m.cable_points[c]; ++i) {
      line.push_back(at++);
      tension.push_back(double{m.cable_tension[c]});
    }
  }
  for (const auto& t : s.triangles) triangles.push_back({t[0], t[1], t[2]});
  const auto scalars = [&](const char* name, const std::vector<double>& of_surface) {
    return DataArray("Float32", name, 1, [&](std::string* to) {
      for (std::size_t i = 0; i < points; ++i) {
        Number(i < of_surface.size() ? of_surface[i] : std::nan(""), to);
      }
    });
  };
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n<PolyData>\n<Piece NumberOfPoints=\"{}\" "
      "NumberOfVerts=\"0\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
      points, lines.size(), triangles.size());
  text += "<PointData>\n";
  text += DataArray("Int32", "body", 1, [&](std::string* to) {  // 0 mantle, 1 arm, 2 rigid, 3 cable
    for (std::size_t i = 0; i < points; ++i) {
      *to += fmt::format("{} ", i < surface_points ? static_cast<int>(s.body[i]) : 3);
    }
  });
  text += scalars("hoop_strain", s.hoop_strain) + scalars("curvature_1_m", s.curvature) +
          scalars("tension_n", tension);
  text += "</PointData>\n<Points>\n";
  text += DataArray("Float32", "Points", 3, [&](std::string* to) {
    for (const Triple& p : s.position) {
      for (const double x : p) Number(x, to);
    }
    for (const auto& p : m.cable_position) {
      for (const float x : p) Number(double{x}, to);
    }
  });
  text += "</Points>\n" + Cells("Lines", lines) + Cells("Polys", triangles);
  return text + "</Piece>\n</PolyData>\n</VTKFile>\n";
}

}  // namespace

void ExportVtk(const RunRecord& run, const PutFile& put) {
  std::string series =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t i = 0; i < run.shapes.size(); ++i) {
    const std::string name = fmt::format("shapes/{:06}.vtp", i);
    put(name, PolyData(run.shapes[i]));
    series += fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n",
                          static_cast<double>(run.shapes[i].utime) / 1e6, name);
  }
  put("shapes.pvd", series + "</Collection>\n</VTKFile>\n");
}

}  // namespace mantle::tools
