#include <Eigen/Eigenvalues>

#include "model/robot_schema.h"

namespace mantle::model {
namespace {

using schema::kAnyValue;
using schema::kNonNegative;
using schema::kPositive;
using schema::Optional;
using schema::Presence;
using schema::Quantity;
using schema::Required;
using schema::Visitor;

}  // namespace

static void Describe(Visitor& v, JetThrust& jet) {
  v.Choice<FluxReading>(
      {"flux", "rate of the enclosed volume, or of its change by the wall's radial velocity alone"},
      {{"volume", FluxReading::kVolume}, {"radial", FluxReading::kRadial}}, &jet.flux);
  v.Choice<ThrustPlace>({"place", "spread over the wall (the paper), or on the dome and its hole"},
                        {{"uniform", ThrustPlace::kUniform}, {"dome", ThrustPlace::kDome}},
                        &jet.place);
  v.Number({"runaway", "a larger thrust stops the run: the jet law has run away"}, Quantity::kForce,
           kPositive, &jet.runaway_n);
}

static void Describe(Visitor& v, LateralDrag& drag) {
  v.Number({"coefficient"}, Quantity::kNumber, kNonNegative, &drag.coefficient);
}

void Describe(Visitor& v, Effects& e) {
  v.Boolean({"weight", "of every body"}, &e.weight);
  v.Boolean({"buoyancy", "of every body"}, &e.buoyancy);
  const bool gravity = e.weight || e.buoyancy;
  const bool given =
      v.Vector({.name = "gravity",
                .also = "with `weight` or `buoyancy`",
                .presence = gravity || v.describing() ? Presence::kDefault : Presence::kOptional},
               Quantity::kAcceleration, kAnyValue, &e.gravity_m_s2);
  v.DemandAt(gravity || !given, "gravity", "given, but neither `weight` nor `buoyancy` is named");
  v.Boolean({.name = "drag",
             .meaning = "of arms, and of the mantle along e3",
             .also = "some coefficient > 0"},
            &e.drag);
  v.Boolean({.name = "added_mass",
             .meaning = "in the inertia, with its Munk moment",
             .also = "some coefficient > 0"},
            &e.added_mass);
  v.Boolean({.name = "viscosity", .meaning = "Kelvin-Voigt", .also = "some viscosity > 0"},
            &e.viscosity);
  v.Boolean({.name = "contained_water",
             .meaning = "mass of the water in the mantle, laterally",
             .also = "a mantle"},
            &e.contained_water);
  v.Boolean({.name = "lateral_added_mass",
             .meaning = "outer added mass of the mantle, laterally",
             .also = "a mantle"},
            &e.lateral_added_mass);
  v.Effect({.name = "jet_thrust", .meaning = "along +e3", .also = "a mantle with `nozzle_radius`"},
           &e.jet_thrust);
  std::optional<Schedule> pressure;
  if (DescribeSchedule(v,
                       {.name = "normal_pressure",
                        .meaning = "inside minus outside, follows the wall",
                        .also = "a mantle"},
                       Quantity::kPressure, kAnyValue, &pressure)) {
    e.normal_pressure = NormalPressure{*pressure};
  }
  v.Effect({.name = "lateral_drag",
            .meaning = "strip theory on the mantle's profile",
            .also = "a mantle"},
           &e.lateral_drag);
  e.named.ForEach([&](auto& effect) { EffectType<decltype(effect)>::Read(v, &effect); });
  const schema::Key current = {"current",
                               "uniform velocity of the water, world frame: steady, or its "
                               "components in time, continuous"};
  v.Either(
      current, schema::Form::kTable,
      [&] {
        UnsteadyCurrent c;
        if (v.Table(Optional(current), [&](Visitor& t) {
              DescribeSchedule(t, {"x"}, Quantity::kSpeed, kAnyValue, &c.x_m_s);
              DescribeSchedule(t, {"y"}, Quantity::kSpeed, kAnyValue, &c.y_m_s);
              DescribeSchedule(t, {"z"}, Quantity::kSpeed, kAnyValue, &c.z_m_s);
            })) {
          e.unsteady_current = c;
        }
      },
      [&] { v.Vector(current, Quantity::kSpeed, kAnyValue, &e.current_m_s); });
}

void Describe(Visitor& v, Material& m) {
  v.Number(Required({"young", "Young's modulus"}), Quantity::kPressure, kPositive, &m.young_pa);
  v.Number({"poisson", "Poisson's ratio"}, Quantity::kNumber, schema::Range{-0.9, 0.5}, &m.poisson);
  v.Number({"viscosity", "shear viscosity (Kelvin-Voigt); acts with `effects.viscosity`"},
           Quantity::kViscosity, kNonNegative, &m.viscosity_pa_s);
  v.Number(Required({"density"}), Quantity::kDensity, kPositive, &m.density_kg_m3);
}

bool DescribeMaterial(Visitor& v, const schema::Key& key, Material* material) {
  schema::Key typed = key;
  typed.type = "material";
  return v.TableOrName(typed, "materials", [&](Visitor& t) { Describe(t, *material); });
}

void Describe(Visitor& v, RigidBody& body) {
  body.name = "rigid_body";
  v.Name({"name"}, &body.name);
  v.OneOf("a rigid body", false,
          {{"cone",
            [&] {
              v.Table({"cone", "apex at the root's origin, axis along -e3"}, [&](Visitor& t) {
                Cone c;
                t.Number(Required({"radius", "of the base"}), Quantity::kLength, kPositive,
                         &c.radius_m);
                t.Number(Required({"height"}), Quantity::kLength, kPositive, &c.height_m);
                t.Number(Required({"density"}), Quantity::kDensity, kPositive, &c.density_kg_m3);
                body.shape = c;
              });
            }},
           {"inertia", [&] {
              v.Table({"inertia", "any body"}, [&](Visitor& t) {
                GivenInertia g;
                t.Number(Required({"mass"}), Quantity::kMass, kPositive, &g.mass_kg);
                t.Vector({"centre", "centre of mass and of buoyancy"}, Quantity::kLength, kAnyValue,
                         &g.centre_m);
                t.Matrix(Required({.name = "matrix",
                                   .meaning = "about the centre of mass",
                                   .also = "symmetric, eigenvalues >= 0"}),
                         Quantity::kInertia, &g.inertia_kg_m2);
                const Matrix3& m = g.inertia_kg_m2;
                t.Demand(m.isApprox(m.transpose(), 1e-12) &&
                             !(Eigen::SelfAdjointEigenSolver<Matrix3>(m).eigenvalues()(0) < 0),
                         "matrix", "must be symmetric with eigenvalues >= 0 kg m^2");
                t.Number({"volume", "displaced"}, Quantity::kVolume, kNonNegative, &g.volume_m3);
                body.shape = g;
              });
            }}});
}

}  // namespace mantle::model
