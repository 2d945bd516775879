#pragma once

#include <variant>
#include <vector>

#include "model/block_tridiagonal.h"
#include "model/mantle_inertia.h"
#include "model/root_loads.h"

/// @file
/// Loads on the mantle: values with forces on profile and root, tangent, power, name and mismatch
/// scale ([Renda] 2.6, [physics.md] 3). Plant, iteration matrix and energy accounts walk one list
/// of them; the reduced model projects the same values' laws on its shapes
/// (reduced/mantle_terms.h). What else a load says of itself is in loads.h.

namespace mantle::model {

/// What loads on the mantle read; evaluated once per state.
struct ShellMotion {
  const Shell& shell;
  const std::vector<Vector3>& shape;  ///< (r, z, theta) per node
  const double* rates;                ///< three per node
  SectionMotion root;                 ///< its rotation, and its twist relative to the water
  bool exact;  ///< coupling: axial loads on the profile move it relative to the root
  double normal_pressure_pa, field_scale;     ///< inside minus outside; of loads of a field
  double volume_rate_m3_s, radial_flux_m3_s;  ///< U_dot, and its part by radial velocity
  double max_radius_m, mean_axial_speed_m_s;  ///< area average of v3 + z_dot
  const MantleInertia& inertia;

  Eigen::Map<const Vector3> rate(int j) const { return Eigen::Map<const Vector3>(rates + 3 * j); }
};

/// Where loads put their forces, and what they report.
struct ShellForces {
  Vector3* node;                   ///< on (r, z, theta) of every node [N, N, N m]; added to
  double* root;                    ///< wrench about the root's origin, 6 entries [N m, N]; added to
  std::vector<Vector3>* gradient;  ///< scratch, one per node
  double *flux_m3_s, *thrust_n, *drag_n;  ///< written by JetLoad and AxialDragLoad
};

/// Where loads put minus the derivatives of their forces in the profile, with rates that change by
/// s. A load that acts on the whole profile through one scalar u has a border of its own: column
/// (what u does to profile and root), row (what they do to u, negative).
/// `at_rest`: about a state that rests in the earth, where s may be zero while the water moves.
struct ShellTangent {
  double s;  ///< [1/s]
  bool at_rest;
  const std::vector<Vector3>& volume_gradient;             ///< dU/d(r, z, theta) per node [m^2]
  BlockTridiagonal<3>* chain;                              ///< between nodes; added to
  Eigen::MatrixXd *column, *row, *base_column, *base_row;  ///< a column each; base: root along e3
};
inline constexpr int kShellLoadBorders = 2;  ///< borders of all loads: `kBorder` below

/// chain -= p d2U/dq2, U the enclosed volume (ShellVolume).
void SubtractVolumeTangent(const std::vector<Vector3>& shape, double p, BlockTridiagonal<3>* chain);

/// Pressure inside minus outside on the wall; follows it.
struct NormalPressureLoad {
  int place{-1};  ///< see PowerNames

  static std::optional<NormalPressureLoad> From(const Mantle& mantle, const Water& water,
                                                const Effects& effects);
  static constexpr bool kField = false;
  void Scale(const Mismatch&) {}
  void Name(const std::string&, PowerNames* names) { place = names->Place("normal_pressure"); }
  void AddForces(const ShellMotion& m, ShellForces* f) const;
  void AddTangent(const ShellMotion& m, ShellTangent* t) const;
  void AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const;
};

/// Jet thrust along +e3, T = -rho_w Q |Q| / A_n; Q = U_dot, or the part of it that the wall's
/// radial velocity makes; A_n = outlets pi h_n^2 for Q < 0, inlets pi h_n^2 for Q > 0 (erratum 10).
struct JetLoad {
  double water_density_kg_m3, nozzle_radius_m;
  int outlets, inlets;  ///< how many nozzles the water leaves and enters by
  FluxReading flux;
  int place{-1};  ///< see PowerNames

  /// The jet at one flux: Q, T and how T changes with Q.
  struct Jet {
    double flux_m3_s, thrust_n;  ///< Q, positive inwards; T, along +e3
    double thrust_by_flux;       ///< dT/dQ [N s/m^3]
  };
  Jet Evaluate(double flux_m3_s) const;
  double Flux(const ShellMotion& m) const {
    return flux == FluxReading::kVolume ? m.volume_rate_m3_s : m.radial_flux_m3_s;
  }

  static std::optional<JetLoad> From(const Mantle& mantle, const Water& water,
                                     const Effects& effects);
  static constexpr bool kField = false;
  static constexpr int kBorder = 0;
  /// The thrust goes with 1 / A_n.
  void Scale(const Mismatch& m);
  void Name(const std::string&, PowerNames* names) { place = names->Place("jet_thrust"); }
  void AddForces(const ShellMotion& m, ShellForces* f) const;
  void AddTangent(const ShellMotion& m, ShellTangent* t) const;
  void AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const;
};

/// Drag along e3, -1/2 rho_w C_d pi max(r)^2 V |V|, V the area average of the absolute axial speed.
struct AxialDragLoad {
  double water_density_kg_m3, coefficient;  ///< C_d
  int place{-1};                            ///< see PowerNames

  double Force(double max_radius_m, double speed_m_s) const;
  double ForceBySpeed(double max_radius_m, double speed_m_s) const;

  static std::optional<AxialDragLoad> From(const Mantle& mantle, const Water& water,
                                           const Effects& effects);
  static constexpr bool kField = false;
  static constexpr int kBorder = 1;
  void Scale(const Mismatch& m) { coefficient *= m.drag; }
  void Name(const std::string& body, PowerNames* names) { place = names->Place("drag." + body); }
  void AddForces(const ShellMotion& m, ShellForces* f) const;
  void AddTangent(const ShellMotion& m, ShellTangent* t) const;
  void AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const;
};

/// Lateral strip-theory drag on the current profile, on the root: force per height
/// -1/2 rho_w C 2 r |u| u, u the lateral velocity of the axis at z.
struct LateralDragLoad {
  double water_density_kg_m3, coefficient;  ///< C
  int place{-1};                            ///< see PowerNames

  Vector6 Wrench(const std::vector<Vector3>& shape, const Vector6& root_twist) const;

  static std::optional<LateralDragLoad> From(const Mantle& mantle, const Water& water,
                                             const Effects& effects);
  static constexpr bool kField = false;
  void Scale(const Mismatch& m) { coefficient *= m.drag; }
  void Name(const std::string&, PowerNames* names) { place = names->Place("lateral_drag"); }
  void AddForces(const ShellMotion& m, ShellForces* f) const;
  void AddTangent(const ShellMotion&, ShellTangent*) const {}
  void AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const;
};

/// Weight and buoyancy of the wall, 2h (rho_s - rho_w) R^T G per area of the reference surface.
struct WallGravityLoad {
  Vector3 gravity_m_s2;  ///< G, world frame
  double half_thickness_m;
  double body_density_kg_m3, water_density_kg_m3;  ///< zero where the effect is not named
  int weight_place{-1}, buoyancy_place{-1};        ///< see PowerNames

  /// Per area [N/m^2], root frame.
  Vector3 SurfaceForce(const Eigen::Quaterniond& root_rotation, double field_scale) const;

  static std::optional<WallGravityLoad> From(const Mantle& mantle, const Water& water,
                                             const Effects& effects);
  static constexpr bool kField = true;
  void Scale(const Mismatch&) {}
  void Name(const std::string&, PowerNames* names);
  void AddForces(const ShellMotion& m, ShellForces* f) const;
  void AddTangent(const ShellMotion&, ShellTangent*) const {}
  void AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const;
};

/// What an accelerating water does to the wall (model/water_acceleration.h): as gravity by -a on
/// its mass, less that on what it displaces.
struct WallWaterAccelerationLoad {
  double half_thickness_m, body_density_kg_m3, water_density_kg_m3;
  int place{-1};

  /// The gravity that it is like; its "buoyancy" works under this load's name.
  WallGravityLoad AsGravity(const Vector3& water_acceleration_m_s2) const {
    return {-water_acceleration_m_s2,
            half_thickness_m,
            body_density_kg_m3,
            water_density_kg_m3,
            -1,
            place};
  }

  static std::optional<WallWaterAccelerationLoad> From(const Mantle& mantle, const Water& water,
                                                       const Effects& effects);
  static constexpr bool kField = false;
  void Scale(const Mismatch&) {}
  void Name(const std::string&, PowerNames* names) { place = names->Place(kWaterAccelerationName); }
  void AddForces(const ShellMotion& m, ShellForces* f) const {
    AsGravity(m.root.water_acceleration_m_s2).AddForces(m, f);
  }
  void AddTangent(const ShellMotion&, ShellTangent*) const {}
  void AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const {
    AsGravity(m.root.water_acceleration_m_s2).AddPower(m, working_twist, power_w);
  }
};

/// Contained water that leaves with the lip's lateral velocity (OutflowWrench); its power counts
/// what the water's own kinetic energy loses with its mass.
struct OutflowLoad {
  int place{-1};  ///< see PowerNames

  static std::optional<OutflowLoad> From(const Mantle& mantle, const Water& water,
                                         const Effects& effects);
  static constexpr bool kField = false;
  void Scale(const Mismatch&) {}
  void Name(const std::string&, PowerNames* names) { place = names->Place("contained_water"); }
  void AddForces(const ShellMotion& m, ShellForces* f) const;
  void AddTangent(const ShellMotion&, ShellTangent*) const {}
  void AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const;
};

using MantleLoad = std::variant<NormalPressureLoad, JetLoad, AxialDragLoad, LateralDragLoad,
                                WallGravityLoad, OutflowLoad, WallWaterAccelerationLoad>;

/// Those that the effects make, on the mantle.
std::vector<MantleLoad> MantleLoads(const Mantle& mantle, const Water& water,
                                    const Effects& effects);

/// The load of a kind in a list, or null.
template <typename Load>
const Load* FindLoad(const std::vector<MantleLoad>& loads) {
  for (const MantleLoad& load : loads) {
    if (const Load* found = std::get_if<Load>(&load)) return found;
  }
  return nullptr;
}

}  // namespace mantle::model
