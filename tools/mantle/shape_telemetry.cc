#include "tools/mantle/shape_telemetry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <variant>

#include "tools/mantle/bad_input.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/loop_telemetry.h"
#include "tools/mantle/trajectory.h"

namespace mantle::tools {
namespace {

using model::Vector3;
using model::Vector6;

// Room for the channel's name, counts and texts beside the lists.
constexpr std::size_t kOverhead_bytes = 1'000;

Triple ToTriple(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

Quaternion ToQuaternion(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

template <std::size_t N, typename Vector>
std::array<float, N> ToFloats(const Vector& v) {
  std::array<float, N> out;
  for (std::size_t k = 0; k < N; ++k) out[k] = static_cast<float>(v(static_cast<Eigen::Index>(k)));
  return out;
}

Vector3 At(const model::Pose& g, const Vector3& p) { return g.position + g.rotation * p; }

// First node of the span behind `node` of a body of `last` + 1 nodes.
int NextKept(int node, int last, int thinning) { return std::min(node + thinning, last); }

// Outline of the rigid body in the root's frame; a given inertia has none.
std::vector<std::array<double, 2>> RigidOutline(const model::Plant& plant) {
  if (!plant.robot.rigid_body) return {};
  const auto* cone = std::get_if<model::Cone>(&plant.robot.rigid_body->shape);
  if (cone == nullptr) return {};
  return {{0, 0}, {cone->radius_m, -cone->height_m}, {0, -cone->height_m}};
}

}  // namespace

ShapeMessages::ShapeMessages(const model::Plant& plant) : plant_(plant) {
  int most = 1;
  for (const model::Rod& rod : plant.rods) {
    message_.arm_name.push_back(rod.name);
    most = std::max(most, rod.element_count());
  }
  if (plant.shell) {
    message_.mantle_name = plant.shell->name;
    message_.mantle_half_thickness = plant.shell->material.half_thickness_m;
    most = std::max(most, plant.shell->element_count());
  }
  message_.rigid_profile = RigidOutline(plant);
  message_.cable_name = CableNames(plant);
  const model::PlantState rest = model::InitialState(plant);
  const std::vector<double> slack(message_.cable_name.size(), 0.0);
  for (;; thinning_ *= 2) {
    Of(rest, slack);
    if (EncodedBytes() <= kMaxMessage_bytes) return;
    if (thinning_ >= most) {
      throw BadInput(fmt::format(
          "--shape-every: a shape of {} arms and {} cables takes {} bytes, must be at most {}: 0 "
          "leaves shapes out",
          message_.arm_name.size(), message_.cable_name.size(), EncodedBytes(), kMaxMessage_bytes));
    }
  }
}

std::size_t ShapeMessages::EncodedBytes() const {
  const ShapeTelemetry& m = message_;
  std::size_t texts = 0;
  for (const auto* names : {&m.arm_name, &m.cable_name}) {
    for (const std::string& name : *names) texts += name.size() + 5;
  }
  return kOverhead_bytes + texts + m.mantle_name.size() + 8 * m.arm_name.size() +
         m.position.size() * (8 * (1 + 3 + 4) + 4) + m.strain.size() * 4 * 12 +
         m.mantle_profile.size() * 8 * 4 + m.mantle_strain.size() * 4 * 10 +
         m.rigid_profile.size() * 16 + m.cable_name.size() * 8 + m.cable_position.size() * 12;
}

const ShapeTelemetry& ShapeMessages::Of(const model::PlantState& state,
                                        const std::vector<double>& tension_n) {
  ShapeTelemetry& m = message_;
  drift_m_ = EvaluateWater(plant_.robot.effects, state.time_s).drift_m;
  m.utime = TelemetryTime(state.time_s);
  m.root_position = ToTriple(state.pose[0].position + drift_m_);
  m.root_quaternion = ToQuaternion(state.pose[0].rotation);
  m.arm_nodes.clear();
  m.arc_length.clear();
  m.position.clear();
  m.quaternion.clear();
  m.radius.clear();
  m.strain.clear();
  m.stress.clear();
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) AddArm(a, state);
  AddMantle(state);
  AddCables(state, tension_n);
  return m;
}

void ShapeMessages::AddArm(int arm, const model::PlantState& state) {
  const auto index = static_cast<std::size_t>(arm);
  const model::Rod& rod = plant_.rods[index];
  const model::Arm& described = plant_.robot.arms[index];
  const int last = rod.element_count();
  ShapeTelemetry& m = message_;
  const std::size_t before = m.position.size();
  for (int i = 0;; i = NextKept(i, last, thinning_)) {
    const model::Pose g = AbsolutePose(plant_, state, arm, i);
    const double x = rod.x_m[static_cast<std::size_t>(i)];
    m.arc_length.push_back(x);
    m.position.push_back(ToTriple(g.position + drift_m_));
    m.quaternion.push_back(ToQuaternion(g.rotation));
    const double taper = described.radius_tip_m - described.radius_base_m;
    m.radius.push_back(static_cast<float>(described.radius_base_m + taper * x / rod.x_m.back()));
    if (i == last) break;
    Vector6 strain = Vector6::Zero(), stress = Vector6::Zero();
    const int end = NextKept(i, last, thinning_);
    for (int e = i; e < end; ++e) {
      const model::RodElement& element = rod.elements[static_cast<std::size_t>(e)];
      model::RodElementState s;
      if (!EvaluateRodElement(
              AbsolutePose(plant_, state, arm, e), AbsolutePose(plant_, state, arm, e + 1),
              AbsoluteTwist(plant_, state, arm, e), AbsoluteTwist(plant_, state, arm, e + 1), &s)) {
        throw std::logic_error(
            fmt::format("{}: element {} turns too far to have a strain", rod.name, e));
      }
      strain += s.d;
      stress += element.length * RodStress(element, s);
    }
    const double length = rod.x_m[static_cast<std::size_t>(end)] - x;
    m.strain.push_back(ToFloats<6>(strain / length));
    m.stress.push_back(ToFloats<6>(stress / length));
  }
  m.arm_nodes.push_back(static_cast<std::int32_t>(m.position.size() - before));
}

void ShapeMessages::AddMantle(const model::PlantState& state) {
  ShapeTelemetry& m = message_;
  m.mantle_arc_length.clear();
  m.mantle_profile.clear();
  m.mantle_strain.clear();
  m.mantle_stress.clear();
  if (!plant_.shell) return;
  const model::Shell& shell = *plant_.shell;
  const int last = shell.element_count();
  for (int j = 0;; j = NextKept(j, last, thinning_)) {
    const auto node = static_cast<std::size_t>(j);
    m.mantle_arc_length.push_back(shell.nodes[node].x_m);
    m.mantle_profile.push_back(ToTriple(state.shape[node]));
    if (j == last) break;
    model::Vector5 strain = model::Vector5::Zero(), stress = model::Vector5::Zero();
    double chord = 0;
    for (int e = j; e < NextKept(j, last, thinning_); ++e) {
      const auto i = static_cast<std::size_t>(e);
      model::ShellElementState s;
      EvaluateShellElement(shell.elements[i], shell.material, state.shape[i], state.shape[i + 1],
                           state.velocity.segment<3>(plant_.ShellVelocity(e)),
                           state.velocity.segment<3>(plant_.ShellVelocity(e + 1)), &s);
      chord += shell.elements[i].chord;
      strain += shell.elements[i].chord * s.strain;
      stress += shell.elements[i].chord * (s.elastic + s.viscous);
    }
    m.mantle_strain.push_back(ToFloats<5>(strain / chord));
    m.mantle_stress.push_back(ToFloats<5>(stress / chord));
  }
}

void ShapeMessages::AddCables(const model::PlantState& state,
                              const std::vector<double>& tension_n) {
  ShapeTelemetry& m = message_;
  m.cable_points.clear();
  m.cable_position.clear();
  m.cable_tension.assign(m.cable_name.size(), 0.0F);
  std::transform(tension_n.begin(),
                 tension_n.begin() + std::min(std::ssize(tension_n), std::ssize(m.cable_name)),
                 m.cable_tension.begin(), [](double n) { return static_cast<float>(n); });
  const auto add = [&](const Vector3& p) { m.cable_position.push_back(ToFloats<3>(p + drift_m_)); };
  for (std::size_t a = 0; a < plant_.rods.size(); ++a) {
    const int arm = static_cast<int>(a), last = plant_.rods[a].element_count();
    const auto& x = plant_.rods[a].x_m;
    const model::Arm& described = plant_.robot.arms[a];
    for (const model::ArmCable& cable : described.cables) {
      const std::size_t before = m.cable_position.size();
      const double end_m = cable.end_m > 0 ? std::min(cable.end_m, x.back()) : x.back();
      for (int i = 0;; i = NextKept(i, last, thinning_)) {
        const model::Pose g = AbsolutePose(plant_, state, arm, i);
        const double at = x[static_cast<std::size_t>(i)];
        add(At(g, ArmCablePath(described, cable, at).offset_m));
        if (i == last || at >= end_m) break;
        const int next = NextKept(i, last, thinning_);
        const double length = x[static_cast<std::size_t>(next)] - at;
        if (at + length <= end_m) continue;
        const model::Pose across = model::Inverse(g) * AbsolutePose(plant_, state, arm, next);
        const double share = (end_m - at) / length;
        add(At(g * model::ExpSE3(share * model::LogSE3(across)),
               ArmCablePath(described, cable, end_m).offset_m));
        break;
      }
      m.cable_points.push_back(static_cast<std::int32_t>(m.cable_position.size() - before));
    }
  }
  if (!plant_.shell) return;
  for (const model::ShellSpokes& spokes : plant_.shell->spokes) {
    double r = 0, z = 0;
    for (std::size_t j = 0; j < state.shape.size(); ++j) {
      const double share = spokes.strip.area_m2[j] / spokes.strip.total_m2;
      r += share * state.shape[j](0);
      z += share * state.shape[j](1);
    }
    for (int k = 0; k < spokes.spokes; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / spokes.spokes;
      add(At(state.pose[0], Vector3(0, 0, z)));
      add(At(state.pose[0], Vector3(r * std::cos(angle), r * std::sin(angle), z)));
    }
    m.cable_points.push_back(2 * spokes.spokes);
  }
}

}  // namespace mantle::tools
