#include "reduced/reduction_schema.h"

#include <algorithm>

#include "model/named_types.h"

namespace mantle::reduced {
namespace {

using schema::kPositive;
using schema::kShare;
using schema::Optional;
using schema::Quantity;
using schema::Range;
using schema::Required;
using schema::Visitor;

void DescribeArmReduction(Visitor& v, ArmReduction& r) {
  v.Choice<BasisKind>({"basis", "strain per segment, or polynomials over the arm"},
                      {{"constant", BasisKind::kConstant}, {"legendre", BasisKind::kLegendre}},
                      &r.basis);
  v.Integer({"segments", "equal segments (constant)"}, 1, 1000, &r.segments);
  v.Numbers(Optional({.name = "segment_ends",
                      .meaning = "ends of the segments instead",
                      .fallback = "equal",
                      .also = "ascending"}),
            Quantity::kLength, kPositive, schema::kOneOrMore, &r.segment_ends_m);
  v.Integer({"degree", "of the polynomials (legendre)"}, 0, 12, &r.degree);
  v.Choice<StrainChoice>({"strains", "which strains vary; four: torsion, two bendings, stretch"},
                         {{"bending", kBending},
                          {"bending_torsion", kBendingTorsion},
                          {"four", kFourStrains},
                          {"six", kSixStrains}},
                         &r.strains);
  v.Choice<SectionRule>(
      {"sections", "where loads and inertia are summed: Gauss rules, or the plant's nodes"},
      {{"radau", SectionRule::kGaussRadau},
       {"legendre", SectionRule::kGaussLegendre},
       {"nodes", SectionRule::kPlantNodes}},
      &r.rule);
  v.Integer({"points", "sections per segment"}, 1, 32, &r.points);
}

void Describe(Visitor& v, MantleReduction& m) {
  v.Integer({"modes", "vibration modes of the mantle"}, 0, 8, &m.modes);
  std::vector<double> pressures;
  if (v.Numbers(Optional({.name = "static_pressures",
                          .meaning = "equilibria of the actuated strip that are shapes",
                          .fallback = "[160, 325]"}),
                Quantity::kPressure, kPositive, schema::kAnyCount, &pressures)) {
    m.static_pressures_pa = pressures;
  }
  v.Integer({"snapshots", "shapes from a run of the plant"}, 0, 8, &m.snapshots);
  v.Number({"snapshot_time", "length of that run"}, Quantity::kTime, Range{1e-3, 1e4},
           &m.snapshot_time_s);
  v.Number({"cubature", "share by which chosen elements may miss the whole mesh; 0: all"},
           Quantity::kNumber, Range{0, 0.5}, &m.cubature_tolerance);
  v.Integer({"lateral_slices", "slices of lateral drag; 0: one per element"}, 0, 100000,
            &m.lateral_slices);
}

// Names of what can be driven, in the order of PlantInputs.
struct Drivable {
  std::vector<std::string> cables, loads, points, strips;
};
Drivable NamesOf(const model::Robot& robot) {
  Drivable d;
  for (const model::Arm& arm : robot.arms) {
    for (const auto& c : arm.cables) d.cables.push_back(arm.name + "." + c.name);
    for (const auto& l : arm.distributed) d.loads.push_back(arm.name + "." + l.name);
    for (const auto& p : arm.points) d.points.push_back(arm.name + "." + p.name);
  }
  if (robot.mantle) {
    for (const auto& s : robot.mantle->spokes) {
      d.cables.push_back(robot.mantle->name + "." + s.name);
    }
    for (const auto& s : robot.mantle->strips) {
      d.strips.push_back(robot.mantle->name + "." + s.name);
    }
  }
  return d;
}

void DescribeTarget(Visitor& v, const Drivable& names, ActuatorTarget& target) {
  using Kind = ActuatorTarget::Kind;
  const auto part = [&](std::string_view key, std::string_view meaning,
                        const std::vector<std::string>& known, Kind kind) {
    return Visitor::Alternative{key, [&v, &target, &known, key, meaning, kind] {
                                  int index = -1;
                                  v.Reference(Required({key, meaning}), known, &index);
                                  target.kind = kind;
                                  target.index = index;
                                }};
  };
  v.OneOf("a target", false,
          {part("cable", "ARM.CABLE or MANTLE.SPOKES", names.cables, Kind::kCable),
           part("load", "ARM.LOAD, a distributed load", names.loads, Kind::kDistributed),
           part("point", "ARM.POINT", names.points, Kind::kPoint),
           part("strip", "MANTLE.STRIP", names.strips, Kind::kStrip)});
  v.Number({"gain"}, Quantity::kNumber, schema::kAnyValue, &target.gain);
}

}  // namespace

std::vector<Actuator> CableActuators(const model::Robot& robot) {
  std::vector<Actuator> motors;
  for (const std::string& name : NamesOf(robot).cables) {
    const int index = static_cast<int>(motors.size());
    motors.push_back({name, {{ActuatorTarget::Kind::kCable, index, 1.0}}});
  }
  return motors;
}

int FindCable(const model::Robot& robot, std::string_view name) {
  return model::IndexOfName("cable", NamesOf(robot).cables, name);
}

void Describe(Visitor& v, const model::Robot& robot, Reduction& r) {
  ArmReduction all;
  DescribeArmReduction(v, all);
  r.arms.assign(std::max<std::size_t>(robot.arms.size(), 1), all);
  std::vector<std::string> arms;
  for (const model::Arm& arm : robot.arms) arms.push_back(arm.name);
  v.Tables(Optional({"arms", "choices for one arm; what it does not say is as for every arm"}),
           [&](Visitor& t, int) {
             int arm = -1;
             t.Reference(Required({"name", "an arm of the scene"}), arms, &arm);
             ArmReduction own = all;
             DescribeArmReduction(t, own);
             if (arm >= 0) r.arms[arm] = own;
           });
  Describe(v, r.mantle);
  v.Choice<StepScheme>(
      {"integrator"},
      {{"sdirk2", StepScheme::kSdirk2}, {"backward_euler", StepScheme::kBackwardEuler}}, &r.scheme);
  v.Number({"step", "longest; steps also end at output times and break points"}, Quantity::kTime,
           schema::kTimeStep, &r.step_s);
  v.Number({"tolerance", "of the stage equations"}, Quantity::kNumber, Range{0, 0.1, true},
           &r.tolerance);
  const Drivable names = NamesOf(robot);
  v.Tables(
      Optional({.name = "actuators",
                .meaning = "motors; each may drive several inputs",
                .fallback = "one per input"}),
      [&](Visitor& t, int index) {
        Actuator& a = r.actuators.emplace_back();
        a.name = "motor" + std::to_string(index + 1);
        t.Name({.name = "name", .fallback = "motor1, ..."}, &a.name);
        t.Tables(
            Required({.name = "drives", .meaning = "what it drives", .also = "at least one"}),
            [&](Visitor& target, int) { DescribeTarget(target, names, a.targets.emplace_back()); });
        t.Demand(!a.targets.empty(), "drives", "is empty, must drive something");
      });
}

}  // namespace mantle::reduced
