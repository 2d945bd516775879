#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

/// CVODE is the reference of the accuracy studies: for every kind of scene it and SDIRK3 at small
/// steps must come to the same solution, in everything a run reports.

namespace mantle::model {
namespace {

using tests::PaperArm;
using tests::PaperMantle;
using tests::Settings;

struct Family {
  std::string name;
  Robot robot;
  double duration_s{0.1}, step_s{0.0005};
};

Robot Bodies(RootMotion root, std::vector<Arm> arms, std::optional<Mantle> mantle,
             std::optional<RigidBody> body) {
  Robot robot;
  robot.name = "robot";
  robot.root = std::move(root);
  robot.arms = std::move(arms);
  robot.mantle = std::move(mantle);
  robot.rigid_body = std::move(body);
  return robot;
}

PrescribedRoot Moved(std::optional<Schedule> x, std::optional<Schedule> z,
                     std::optional<Schedule> angle) {
  PrescribedRoot root;
  root.x_m = std::move(x);
  root.z_m = std::move(z);
  root.angle_rad = std::move(angle);
  root.rotation_axis = Vector3(2, -1, 2) / 3.0;
  return root;
}

// Every kind of scene in scenes/, and of root: coarse meshes, since both see the same one.
std::vector<Family> Families() {
  std::vector<Family> all;
  const auto add = [&](const char* name, const Robot& robot, double duration = 0.1) -> Robot& {
    all.push_back({name, robot, duration});
    return all.back().robot;
  };
  const SineSchedule sine{0.01, 3, 0.2, 0, 0};
  const TableSchedule table{{0, 0.03, 0.08}, {0, 0.004, -0.002}};
  const Robot arm = Bodies(ClampedRoot{}, {PaperArm(5)}, {}, {});
  const Robot mantle = Bodies(ClampedRoot{}, {}, PaperMantle(20, 3), {});
  const auto water = [](Effects* e) { e->drag = e->added_mass = e->viscosity = true; };

  Robot& loaded = add("arm with loads of both frames", arm);
  water(&loaded.effects);
  loaded.effects.weight = loaded.effects.buoyancy = true;
  loaded.arms[0].material.density_kg_m3 = 1200;
  loaded.arms[0].points = {{"tip", 0.42, 0.2 * Vector6::Unit(4), LoadFrame::kBody, sine},
                           {"mid", 0.2, 0.2 * Vector6::Unit(5), LoadFrame::kWorld, table}};
  loaded.arms[0].distributed = {
      {"torque", Vector6::Unit(2), 0.05, 0, LoadFrame::kBody, IntervalSchedule{1, {0.02}, {0.05}}}};
  Robot& cables = add("arm with given and reeled cables", arm);
  water(&cables.effects);
  cables.arms[0].cables = {
      {"given", 0.6, 0.4, 0.2, 0.42, GivenTension{SineSchedule{0.2, 3, 0, 0.3, 0}}, {}},
      {"reeled",
       0.6,
       2.5,
       0,
       0.42,
       ReeledLength{SineSchedule{0.004, 3, 0, -0.02, 0}, 20, 0.2},
       {}}};
  Robot& vibrating = add("arm that vibrates in vacuo", arm);
  vibrating.arms[0].initial_mode1_tip_speed_m_s = 0.3;
  Robot& curved = add("arm curved at rest", arm);
  curved.arms[0].curvature_base = curved.arms[0].curvature_tip = {1.0, 3.0, 0.5};
  water(&curved.effects);
  curved.effects.weight = true;
  Robot& held = add("arm held in a current", arm);
  water(&held.effects);
  held.effects.current_m_s = Vector3(0.2, 0.1, -0.1);
  Robot& tumbling = add("free arm that tumbles", Bodies(FreeRoot{}, {PaperArm(5)}, {}, {}));
  tumbling.root_twist << 3, 2, 1, 0.2, 0, 0.1;
  tumbling.effects.added_mass = true;

  Robot& strip = add("clamped mantle under a pulse", mantle);
  water(&strip.effects);
  strip.mantle->strips = {{"pulse", 0.025, 0.105, TriangularSchedule{0, 200, 0.12, 0}}};
  strip.mantle->spokes = {{"winch", 0.025, 0.105, 8, ReeledLength{sine, 20, 0.2}}};
  Robot& pressed = add("mantle under pressure", mantle);
  pressed.effects.viscosity = true;
  pressed.effects.normal_pressure = NormalPressure{SineSchedule{20, 2, 0, 0, 0}};
  Robot& ring = add("mantle that rings", mantle);
  ring.mantle->initial_radial_speed_m_s = 0.01;
  ring.effects.viscosity = true;
  for (const FluxReading flux : {FluxReading::kVolume, FluxReading::kRadial}) {
    for (const ThrustPlace place : {ThrustPlace::kUniform, ThrustPlace::kDome}) {
      Robot& jet = add(flux == FluxReading::kVolume ? "free mantle, jet of the volume's flux"
                                                    : "free mantle, jet of the radial flux",
                       Bodies(FreeRoot{}, {}, PaperMantle(20, 3), tests::PaperCone()));
      water(&jet.effects);
      jet.effects.jet_thrust = JetThrust{flux, place};
      jet.mantle->strips = {{"pulse", 0.025, 0.105, TriangularSchedule{0, 100, 0.2, 0}}};
    }
  }

  Robot vehicle = tests::PaperRobot(4, 20);
  vehicle.effects = tests::EveryEffect();
  vehicle.effects.jet_thrust->place = ThrustPlace::kDome;
  vehicle.arms[0].material.density_kg_m3 = 1040;
  vehicle.mantle->strips = {{"pulse", 0.025, 0.105, TriangularSchedule{0, 150, 0.2, 0}}};
  vehicle.arms[0].cables = {{"given", 0.6, 0.4, 0, 0.42, GivenTension{ConstantSchedule{0.2}}, {}}};
  add("free vehicle, every effect", vehicle);
  add("free vehicle in a current", vehicle).effects.current_m_s = Vector3(0.1, 0.2, -0.1);
  add("clamped vehicle", vehicle).root = ClampedRoot{};
  add("frozen coupling", vehicle).coupling = Coupling::kFrozen;
  Robot& octopus = add("two arms on a vehicle", vehicle);
  octopus.arms.push_back(octopus.arms[0]);
  octopus.arms[1].name = "second";
  octopus.arms[1].mount.rotation = ExpSO3(Vector3(0, 0.5, 0.3));
  add("rigid body that sinks", Bodies(FreeRoot{}, {}, {}, tests::PaperCone())).effects.weight =
      true;

  for (const bool smooth : {true, false}) {
    const Schedule s = smooth ? Schedule(sine) : Schedule(table);
    const Schedule turn = smooth ? Schedule(SineSchedule{0.3, 2, 0.4, 0, 0})
                                 : Schedule(TableSchedule{{0, 0.05, 0.1}, {0.1, 0.2, 0.1}});
    const char* kind = smooth ? " (smooth)" : " (kinks)";
    add("mantle shaken along its axis", mantle).root = Moved({}, s, {});
    all.back().name += kind;
    all.back().robot.effects.viscosity = true;
    add("mantle turned and shaken", mantle).root = Moved(s, s, turn);
    all.back().name += kind;
    water(&all.back().robot.effects);
    add("arm shaken and turned", arm).root = Moved(s, {}, turn);
    all.back().name += kind;
    water(&all.back().robot.effects);
    add("vehicle carried", vehicle).root = Moved(s, s, turn);
    all.back().name += kind;
  }
  return all;
}

TEST(Reference, CvodeAndSmallStepsComeToTheSameSolutionInEveryKindOfScene) {
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.name);
    const Plant plant(family.robot);
    const auto end = [&](Integrator integrator, double* peak_j) {
      RunSettings settings = Settings(integrator, family.step_s, family.duration_s);
      settings.stepper.relative_tolerance = 1e-8;
      settings.stepper.absolute_tolerance = 1e-10;
      Simulation simulation(plant, settings);
      const RunResult result = simulation.Run([&](const Sample& s) {
        *peak_j = std::max(*peak_j, s.energies.magnitude());
        return true;
      });
      EXPECT_TRUE(result.ok) << result.reason;
      return result;
    };
    double peak_j = 0, peak_fixed_j = 0;
    const RunResult reference = end(Integrator::kCvode, &peak_j);
    const RunResult fixed = end(Integrator::kSdirk3, &peak_fixed_j);
    const Sample &a = reference.last, &b = fixed.last;
    // What SDIRK3 leaves at half a millisecond where the shell's stiffness takes it to order 2.
    constexpr double kShare = 1e-4;
    const double length = kShare * plant.body_length_m;
    EXPECT_LT((a.root.position - b.root.position).norm(), length);
    EXPECT_LT(a.root.rotation.angularDistance(b.root.rotation), 5 * kShare) << "rad";
    for (std::size_t i = 0; i < a.tips.size(); ++i) {
      EXPECT_LT((a.tips[i].position - b.tips[i].position).norm(), length) << i;
    }
    constexpr double kEnergyShare = 2e-3;
    EXPECT_GT(peak_j, 0.0);
    EXPECT_NEAR(a.energies.elastic_arms_j, b.energies.elastic_arms_j, kEnergyShare * peak_j);
    EXPECT_NEAR(a.energies.elastic_mantle_j, b.energies.elastic_mantle_j, kEnergyShare * peak_j);
    EXPECT_NEAR(a.energies.total(), b.energies.total(), kEnergyShare * peak_j);
    EXPECT_NEAR(a.volume_m3, b.volume_m3, 1e-4 * std::abs(b.volume_m3));
    double works = peak_j + reference.dissipated_j;
    for (double w : reference.work_j) works += std::abs(w);
    ASSERT_EQ(reference.work_names, fixed.work_names);
    for (std::size_t i = 0; i < fixed.work_j.size(); ++i) {
      EXPECT_NEAR(reference.work_j[i], fixed.work_j[i], kEnergyShare * works)
          << fixed.work_names[i];
    }
  }
}

}  // namespace
}  // namespace mantle::model
