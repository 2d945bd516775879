#include "tools/mantle/water_telemetry.h"

#include <algorithm>
#include <stdexcept>
#include <variant>

#include "tools/mantle/loop_telemetry.h"

namespace mantle::tools {
namespace {

using model::Vector3;

Triple ToTriple(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

template <typename Load, typename Variant>
bool AnyOf(const std::vector<Variant>& loads) {
  return std::any_of(loads.begin(), loads.end(),
                     [](const Variant& load) { return std::holds_alternative<Load>(load); });
}

}  // namespace

WaterMessages::WaterMessages(const model::Plant& plant, int thinning)
    : plant_(plant), thinning_(thinning), work_(plant) {
  for (const model::Rod& rod : plant.rods) active_ |= AnyOf<model::DragLoad>(rod.loads);
  active_ |= AnyOf<model::AxialDragLoad>(plant.mantle_loads) ||
             AnyOf<model::LateralDragLoad>(plant.mantle_loads) ||
             AnyOf<model::RigidDrag::RootLoad>(plant.root_loads);
}

const WaterTelemetry& WaterMessages::Of(const model::PlantState& state) {
  if (plant_.shell) {  // for the motion of the whole mantle
    EvaluateInputs(plant_, state.time_s, false, &inputs_);
    if (const auto failure = EvaluateForces(plant_, state, inputs_, &work_)) {
      throw std::logic_error(failure.Message());
    }
  }
  message_.utime = TelemetryTime(state.time_s);
  message_.current = ToTriple(EvaluateWater(plant_.robot.effects, state.time_s).velocity_m_s);
  message_.drag.clear();
  for (std::size_t a = 0; a < plant_.rods.size(); ++a) {
    const model::Rod& rod = plant_.rods[a];
    const int last = rod.element_count();
    for (int i = 0;; i = std::min(i + thinning_, last)) {
      const auto node = static_cast<std::size_t>(i);
      const model::SectionMotion motion{
          AbsolutePose(plant_, state, static_cast<int>(a), i).rotation,
          AbsoluteTwist(plant_, state, static_cast<int>(a), i)};
      Vector3 force = Vector3::Zero();
      for (const model::SectionLoad& load : rod.loads) {
        const auto* drag = std::get_if<model::DragLoad>(&load);
        if (drag != nullptr) force += drag->Density(rod.nodes[node].section, motion).tail<3>();
      }
      const Vector3 f = motion.rotation * force;
      message_.drag.push_back(
          {static_cast<float>(f.x()), static_cast<float>(f.y()), static_cast<float>(f.z())});
      if (i == last) break;
    }
  }
  message_.body_drag = ToTriple(state.pose[0].rotation * BodyDrag(state));
  return message_;
}

// In the root's frame.
Vector3 WaterMessages::BodyDrag(const model::PlantState& state) const {
  Vector3 force = Vector3::Zero();
  if (plant_.shell) {
    const model::ShellMotion m = MantleMotionOf(plant_, state, inputs_, work_);
    for (const model::MantleLoad& load : plant_.mantle_loads) {
      if (const auto* axial = std::get_if<model::AxialDragLoad>(&load)) {
        force.z() += axial->Force(m.max_radius_m, m.mean_axial_speed_m_s);
      } else if (const auto* lateral = std::get_if<model::LateralDragLoad>(&load)) {
        force += lateral->Wrench(state.shape, m.root.twist).tail<3>();
      }
    }
  }
  const model::SectionMotion root{state.pose[0].rotation, state.velocity.head<6>()};
  for (const model::RootLoad& load : plant_.root_loads) {
    const auto* rigid = std::get_if<model::RigidDrag::RootLoad>(&load);
    if (rigid != nullptr) force += rigid->Wrench(root).tail<3>();
  }
  return force;
}

}  // namespace mantle::tools
