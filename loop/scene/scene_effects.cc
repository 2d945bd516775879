#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

// An effect with settings: `true` for their defaults, `false` or absent for none, or a table.
template <typename Effect, typename Read>
std::optional<Effect> ReadEffect(TomlReader* effects, std::string_view key, Read read) {
  const TomlValue* value = effects->Raw(key);
  if (value == nullptr) return std::nullopt;
  if (value->kind == TomlValue::Kind::kBoolean) {
    return value->boolean ? std::optional<Effect>(Effect{}) : std::nullopt;
  }
  if (value->kind != TomlValue::Kind::kTable) {
    effects->Fail(key, "must be true, false or a table of settings");
  }
  TomlReader table = effects->Table(key);
  Effect effect;
  read(&table, &effect);
  table.Finish();
  return effect;
}

void ReadJet(TomlReader* table, JetThrust* jet) {
  jet->flux = table->Choice<FluxReading>(
      "flux", {{"volume", FluxReading::kVolume}, {"radial", FluxReading::kRadial}}, jet->flux);
  jet->place = table->Choice<ThrustPlace>(
      "place", {{"uniform", ThrustPlace::kUniform}, {"dome", ThrustPlace::kDome}}, jet->place);
  jet->runaway_n = table->Number("runaway", Quantity::kForce, kPositive, jet->runaway_n);
}

void ReadRigidDrag(TomlReader* table, RigidDrag* drag) {
  drag->lateral_coefficient = table->Number("lateral_coefficient", Quantity::kNumber, kNonNegative,
                                            drag->lateral_coefficient);
  drag->axial_coefficient =
      table->Number("axial_coefficient", Quantity::kNumber, kNonNegative, drag->axial_coefficient);
  drag->lateral_area_m2 = table->OptionalNumber("lateral_area", Quantity::kArea, kNonNegative);
  drag->axial_area_m2 = table->OptionalNumber("axial_area", Quantity::kArea, kNonNegative);
}

}  // namespace

Material ReadMaterialTable(TomlReader table) {
  Material m;
  m.young_pa = table.Number("young", Quantity::kPressure, kPositive);
  m.poisson = table.Number("poisson", Quantity::kNumber, Range{-0.9, 0.5}, 0.0);
  m.viscosity_pa_s = table.Number("viscosity", Quantity::kViscosity, kNonNegative, 0.0);
  m.density_kg_m3 = table.Number("density", Quantity::kDensity, kPositive);
  table.Finish();
  return m;
}

Material ReadMaterial(TomlReader* parent, std::string_view key) {
  const TomlValue* value = parent->Raw(key);
  std::optional<TomlReader> table;
  SceneContext* context = &parent->context();
  if (value != nullptr && value->kind == TomlValue::Kind::kText) {
    const TomlValue* named =
        context->materials == nullptr ? nullptr : context->materials->Find(value->text);
    if (named == nullptr) parent->Fail(key, "is not in [materials]");
    table.emplace(*named, "materials." + value->text, "material", context);
  } else {
    table = parent->OptionalTable(key, "material");
  }
  if (!table) parent->Fail(key, "is missing: must be a name from [materials] or a table");
  return ReadMaterialTable(*table);
}

RigidBody ReadRigidBody(TomlReader table) {
  RigidBody body;
  body.name = table.Name("name", "rigid_body");
  auto cone = table.OptionalTable("cone");
  auto given = table.OptionalTable("inertia");
  if (cone.has_value() == given.has_value()) {
    table.Fail(cone ? "inertia" : "cone",
               "a rigid body must have exactly one of `cone` and `inertia`");
  }
  if (cone) {
    body.shape = Cone{cone->Number("radius", Quantity::kLength, kPositive),
                      cone->Number("height", Quantity::kLength, kPositive),
                      cone->Number("density", Quantity::kDensity, kPositive)};
    cone->Finish();
  } else {
    GivenInertia g;
    g.mass_kg = given->Number("mass", Quantity::kMass, kPositive);
    g.centre_m = given->Vector("centre", Quantity::kLength, Vector3::Zero());
    g.inertia_kg_m2 = given->Matrix("matrix", Quantity::kInertia);
    g.volume_m3 = given->Number("volume", Quantity::kVolume, kNonNegative, 0.0);
    const Matrix3& m = g.inertia_kg_m2;
    if (!m.isApprox(m.transpose(), 1e-12) ||
        Eigen::SelfAdjointEigenSolver<Matrix3>(m).eigenvalues()(0) < 0) {
      given->Fail("matrix", "must be symmetric with eigenvalues >= 0 kg m^2");
    }
    body.shape = g;
    given->Finish();
  }
  table.Finish();
  return body;
}

Effects ReadEffects(TomlReader table) {
  Effects e;
  e.gravity_m_s2 = table.Vector("gravity", Quantity::kAcceleration, e.gravity_m_s2);
  e.weight = table.Boolean("weight", false);
  e.buoyancy = table.Boolean("buoyancy", false);
  e.drag = table.Boolean("drag", false);
  e.added_mass = table.Boolean("added_mass", false);
  e.viscosity = table.Boolean("viscosity", false);
  e.contained_water = table.Boolean("contained_water", false);
  e.lateral_added_mass = table.Boolean("lateral_added_mass", false);
  e.jet_thrust = ReadEffect<JetThrust>(&table, "jet_thrust", ReadJet);
  if (auto pressure =
          ReadOptionalSchedule(&table, "normal_pressure", Quantity::kPressure, kAnyValue)) {
    e.normal_pressure = NormalPressure{*pressure};
  }
  e.lateral_drag =
      ReadEffect<LateralDrag>(&table, "lateral_drag", [](TomlReader* t, LateralDrag* d) {
        d->coefficient = t->Number("coefficient", Quantity::kNumber, kNonNegative, d->coefficient);
      });
  e.roll_drag = ReadEffect<RollDrag>(&table, "roll_drag", [](TomlReader* t, RollDrag* d) {
    d->coefficient_n_m_s2 =
        t->Number("coefficient", Quantity::kRollDrag, kNonNegative, d->coefficient_n_m_s2);
  });
  e.rigid_drag = ReadEffect<RigidDrag>(&table, "rigid_drag", ReadRigidDrag);
  e.current_m_s = table.OptionalVector("current", Quantity::kSpeed);
  table.Finish();
  return e;
}

}  // namespace mantle::scene
