#pragma once

#include <string>
#include <vector>

#include "model/plant.h"

/// Energies, powers and works by name, assembled element by element and load by load, independently
/// of the integrator and of the assembled force vector. The semi-discrete power balance is
///
///   dT/dt + dV/dt + dissipation = sum of load powers + constraint power,
///   T = 1/2 v^T M v,  dT/dt = v^T M v_dot + 1/2 v^T M_dot v,
///
/// which holds to round-off for exact coupling. Frozen coupling has no such balance ([physics.md]
/// 4). All are the earth's: under a uniform current c a load of resultant F does F . c more work
/// than the water sees, and the kinetic energy is, with T', P' as the water sees them (solid and
/// added),
///
///   T = T' + c . P' + 1/2 m_solid |c|^2,
///
/// the water's share T'_water + c . P'_water being what the body adds to the undisturbed stream
/// (negative for a body held in it). The balance then contains that of momentum along c. Where c
/// changes in time, dT/dt gains c_dot . (P' + m_solid c), and the water works by its pressure
/// gradient and c_dot . P'_water (model/water_acceleration.h).

namespace mantle::model {

struct Energies {
  double kinetic_solid_j{0}, kinetic_water_j{0}, elastic_arms_j{0}, elastic_mantle_j{0};
  double total() const {
    return kinetic_solid_j + kinetic_water_j + elastic_arms_j + elastic_mantle_j;
  }
  double magnitude() const;  ///< sum of the magnitudes: what a balance of them is relative to
};

/// In the earth's frame; `work` from EvaluateForces at that state.
Energies EvaluateEnergies(const Plant& plant, const PlantState& state, const PlantWork& work);

class EnergyAccount {
 public:
  explicit EnergyAccount(const Plant& plant);

  /// Names of loads and cables ("weight", "drag.arm1", "cable.arm1.left", "jet_thrust", ...); what
  /// the scene does not name is not here.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<double>& work_j() const { return work_; }
  double dissipated_j() const { return dissipated_; }
  void Restore(const std::vector<double>& work_j, double dissipated_j) {
    work_ = work_j;
    dissipated_ = dissipated_j;
  }
  /// Work that is done at one instant [J]: an impulse of the root's support (`place` is
  /// Plant::constraint_place), or what a payload that is dropped takes with it.
  void AddWork(int place, double work_j) { work_[place] += work_j; }

  /// Powers [W] of every name at one instant (`work` from EvaluateForces at that state,
  /// `acceleration` the v_dot there; used for the constraint power of a prescribed root alone).
  void EvaluatePowers(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                      const PlantWork& work, const VectorX& acceleration);
  const std::vector<double>& power_w() const { return power_; }
  double dissipation_w() const { return dissipation_; }
  double stress_power_arms_w() const { return stress_power_arms_; }
  double stress_power_mantle_w() const { return stress_power_mantle_; }

  /// Quadrature of a step: Begin, Accumulate(weight) at each stage, Commit. Works change on Commit.
  void Begin();
  void Accumulate(double weight_s);
  void Commit();

  /// dT/dt + dV/dt + dissipation - powers [W] and the sum of the magnitudes of all of these, at the
  /// instant of the last EvaluatePowers, with the semi-discrete acceleration of that state.
  struct Balance {
    double residual_w, scale_w;
  };
  Balance EvaluateBalance(const Plant& plant, const PlantState& state, const PlantWork& work,
                          const VectorX& acceleration);

 private:
  void AddArmPowers(const Plant& plant, int a, const PlantState& state, const PlantInputs& inputs,
                    const PlantWork& work, int first_distributed, int first_point);
  void AddMantlePowers(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                       const PlantWork& work, const Vector6& earth_root);

  std::vector<std::string> names_;
  std::vector<double> power_, work_, pending_;
  double dissipation_{0}, dissipated_{0}, pending_dissipation_{0};
  double stress_power_arms_{0}, stress_power_mantle_{0};
  VectorX scratch_;
};

}  // namespace mantle::model
