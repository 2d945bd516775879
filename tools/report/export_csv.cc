#include <fmt/format.h>

#include <iterator>

#include "tools/report/export_formats.h"

namespace mantle::tools {
namespace {

class Table {
 public:
  explicit Table(std::string_view titles) : text_(titles) { text_ += '\n'; }

  template <typename... Values>
  void Row(double time_s, const Values&... values) {
    fmt::format_to(std::back_inserter(text_), "{}", time_s);
    (Add(values), ...);
    text_ += '\n';
  }
  const std::string& text() const { return text_; }

 private:
  template <typename T>
  void Add(const T& value) {
    if constexpr (requires { value.size(); } && !std::is_convertible_v<T, std::string_view>) {
      for (const auto& v : value) Add(v);
    } else {
      fmt::format_to(std::back_inserter(text_), ",{}", value);
    }
  }
  std::string text_;
};

}  // namespace

void ExportCsv(const RunRecord& run, const PutFile& put) {
  Table root("time_s,x_m,y_m,z_m,qw,qx,qy,qz");
  Table nodes("time_s,arm,node,arc_length_m,x_m,y_m,z_m,qw,qx,qy,qz,radius_m");
  Table spans(
      "time_s,arm,span,torsion_1_m,curvature_y_1_m,curvature_z_1_m,stretch,shear_y,shear_z,"
      "moment_x_n_m,moment_y_n_m,moment_z_n_m,force_x_n,force_y_n,force_z_n");
  Table mantle_nodes("time_s,node,arc_length_m,r_m,z_m,theta_rad");
  Table mantle_spans(
      "time_s,span,e11,e22,d11_1_m,d22_1_m,beta,n_x_n_m,n_phi_n_m,m_x_n,m_phi_n,h_n_m");
  Table cables("time_s,cable,point,x_m,y_m,z_m,tension_n");
  for (const ShapeTelemetry& m : run.shapes) {
    const double t = static_cast<double>(m.utime) / 1e6;
    root.Row(t, m.root_position, m.root_quaternion);
    std::size_t node = 0, span = 0;
    for (std::size_t a = 0; a < m.arm_name.size(); ++a) {
      const auto n = static_cast<std::size_t>(m.arm_nodes[a]);
      for (std::size_t i = 0; i < n; ++i, ++node) {
        nodes.Row(t, m.arm_name[a], i, m.arc_length[node], m.position[node], m.quaternion[node],
                  m.radius[node]);
      }
      for (std::size_t i = 0; i + 1 < n; ++i, ++span) {
        spans.Row(t, m.arm_name[a], i, m.strain[span], m.stress[span]);
      }
    }
    for (std::size_t i = 0; i < m.mantle_profile.size(); ++i) {
      mantle_nodes.Row(t, i, m.mantle_arc_length[i], m.mantle_profile[i]);
    }
    for (std::size_t i = 0; i < m.mantle_strain.size(); ++i) {
      mantle_spans.Row(t, i, m.mantle_strain[i], m.mantle_stress[i]);
    }
    std::size_t point = 0;
    for (std::size_t c = 0; c < m.cable_name.size(); ++c) {
      for (std::int32_t i = 0; i < m.cable_points[c]; ++i, ++point) {
        cables.Row(t, m.cable_name[c], i, m.cable_position[point], m.cable_tension[c]);
      }
    }
  }
  put("root.csv", root.text());
  put("nodes.csv", nodes.text());
  put("spans.csv", spans.text());
  put("mantle_nodes.csv", mantle_nodes.text());
  put("mantle_spans.csv", mantle_spans.text());
  put("cables.csv", cables.text());
}

}  // namespace mantle::tools
