#pragma once

#include <cmath>
#include <optional>

#include "model/schema.h"
#include "model/section.h"

namespace mantle::model {

/// The effect `roll_drag`: drag of fins against turning about e3, the moment -c omega3 |omega3|.
struct RollDrag {
  double coefficient_n_m_s2{1.2e-3};  ///< c

  struct RootLoad;
  static constexpr const char* kName = "roll_drag";
  static constexpr bool kOnVelocity = true;
  static constexpr const char* kWithoutPotential = nullptr;

  static void Read(schema::Visitor& v, std::optional<RollDrag>* effect) {
    v.Effect({kName, "quadratic, about e3: fins"}, effect);
  }
};

inline void Describe(schema::Visitor& v, RollDrag& drag) {
  v.Number({"coefficient", "four fins of 40 x 100 mm"}, schema::Quantity::kRollDrag,
           schema::kNonNegative, &drag.coefficient_n_m_s2);
}

/// Its moment on the root.
struct RollDrag::RootLoad {
  double coefficient_n_m_s2;
  int place{-1};  ///< see PowerNames

  static std::optional<RootLoad> From(const RollDrag& drag, const Bodies&) {
    return RootLoad{drag.coefficient_n_m_s2};
  }
  static constexpr bool kField = false;
  void Scale(const Mismatch& m) { coefficient_n_m_s2 *= m.drag; }
  void Name(PowerNames* names) { place = names->Place(kName); }
  Vector6 Wrench(const SectionMotion& root) const {
    Vector6 w = Vector6::Zero();
    w(2) = -coefficient_n_m_s2 * root.twist(2) * std::abs(root.twist(2));
    return w;
  }
  void AddTangent(const SectionMotion& root, double scale, RootTangent* t) const {
    t->by_twist(2, 2) += scale * (-2.0 * coefficient_n_m_s2 * std::abs(root.twist(2)));
  }
  void AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                double* power_w) const {
    power_w[place] += scale * Wrench(root).dot(working_twist);
  }
};

}  // namespace mantle::model
