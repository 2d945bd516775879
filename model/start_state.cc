#include "model/start_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/modes.h"

namespace mantle::model {
namespace {

constexpr double kSameFrequency = 1e-6;  // relative: modes of a section without a preferred plane
constexpr int kSubsteps = 16;            // Magnus steps per element of a given shape

[[noreturn]] void RefuseTipSpeed(const Arm& arm, const std::string& why) {
  throw BadRobot(fmt::format("arms.{}.initial_mode1_tip_speed = {} m/s: {}", arm.name,
                             arm.initial_mode1_tip_speed_m_s, why));
}

// An arm clamped alone, with its added mass.
Robot Alone(const Plant& plant, std::size_t a) {
  Robot alone;
  alone.name = plant.robot.name;
  alone.root = ClampedRoot{};
  alone.water = plant.robot.water;
  alone.effects.added_mass = plant.robot.effects.added_mass;
  alone.arms = {plant.robot.arms[a]};
  alone.arms[0].mount = Pose::Identity();
  alone.arms[0].muscles.clear();
  return alone;
}

// The two lowest modes of an arm that is clamped alone.
std::vector<Mode> BendingModes(const Plant& rod) {
  try {
    return VibrationModes(rod, InitialState(rod), 2);
  } catch (const BadRobot& error) {
    RefuseTipSpeed(rod.robot.arms[0],
                   std::string("the arm's first bending mode is not found: ") + error.what());
  }
}

// Velocity of the first bending mode of a clamped arm, scaled to the tip speed of its key.
void AddModeVelocity(const Plant& plant, PlantState* state) {
  for (std::size_t a = 0; a < plant.robot.arms.size(); ++a) {
    const double speed = plant.robot.arms[a].initial_mode1_tip_speed_m_s;
    if (speed == 0.0) continue;
    const Plant rod(Alone(plant, a));
    // The two bending modes of a round section coincide: take their combination along base y.
    const std::vector<Mode> modes = BendingModes(rod);
    const int n = rod.rods[0].element_count();
    const Eigen::Quaterniond tip = rod.rods[0].reference[n].rotation;
    const int at = rod.ArmVelocity(0, n);
    Eigen::Matrix2d tips;
    for (int k = 0; k < 2; ++k) {
      tips.col(k) = (tip * Vector3(modes[k].shape.segment<3>(at + 3))).tail<2>();
    }
    Eigen::Vector2d c = tips.fullPivLu().solve(Eigen::Vector2d(speed, 0.0));
    if (!c.allFinite()) c = Eigen::Vector2d(speed / tips(0, 0), 0.0);
    if (!c.allFinite()) RefuseTipSpeed(plant.robot.arms[a], "the mode does not move the tip");
    const int arm = static_cast<int>(a);
    for (int i = 1; i <= n; ++i) {
      for (int k = 0; k < 2; ++k) {
        state->velocity.segment<6>(plant.ArmVelocity(arm, i)) +=
            c(k) * modes[k].shape.segment<6>(rod.ArmVelocity(0, i));
      }
    }
  }
}

Eigen::Vector2d TipAcross(const Plant& rod, const VectorX& shape) {
  const int n = rod.rods[0].element_count();
  const Eigen::Quaterniond tip = rod.rods[0].reference[n].rotation;
  return (tip * Vector3(shape.segment<3>(rod.ArmVelocity(0, n) + 3))).tail<2>();
}

// Shape of the mode of that number. Two of one frequency have no planes of their own: the first
// moves the tip along y of the base frame, the second along z.
VectorX ShapeOfMode(const Plant& rod, int number) {
  const std::vector<Mode> modes = VibrationModes(rod, InitialState(rod), number + 1);
  const auto same = [&](int i, int k) {
    const double a = modes[i].angular_frequency_rad_s, b = modes[k].angular_frequency_rad_s;
    return std::abs(a - b) <= kSameFrequency * b;
  };
  const int i = number - 1;
  const bool second = i > 0 && same(i - 1, i) && (i < 2 || !same(i - 2, i - 1));
  const int first = second ? i - 1 : i;
  if (!same(first, first + 1)) return modes[i].shape;
  Eigen::Matrix2d tips;
  for (int k = 0; k < 2; ++k) tips.col(k) = TipAcross(rod, modes[first + k].shape);
  const Eigen::Vector2d c = tips.fullPivLu().solve(Eigen::Vector2d(!second, second));
  const VectorX shape = c(0) * modes[first].shape + c(1) * modes[first + 1].shape;
  return shape.allFinite() && !shape.isZero(0.0) ? shape : modes[i].shape;
}

void AddModesByNumber(const Plant& plant, PlantState* state) {
  for (std::size_t a = 0; a < plant.robot.arms.size(); ++a) {
    const Arm& arm = plant.robot.arms[a];
    if (arm.initial_modes.empty()) continue;
    const Plant rod(Alone(plant, a));
    for (std::size_t k = 0; k < arm.initial_modes.size(); ++k) {
      const InitialMode& mode = arm.initial_modes[k];
      if (mode.speed_m_s == 0.0) continue;
      VectorX shape;
      try {
        shape = ShapeOfMode(rod, mode.number);
      } catch (const BadRobot& error) {
        throw BadRobot(fmt::format("arms.{}.initial_modes[{}].mode = {}: the mode is not found: {}",
                                   arm.name, k, mode.number, error.what()));
      }
      double fastest = 0;
      for (int i = 1; i <= arm.elements; ++i) {
        fastest = std::max(fastest, shape.segment<3>(rod.ArmVelocity(0, i) + 3).norm());
      }
      if (!(fastest > 0.0)) {
        throw BadRobot(fmt::format(
            "arms.{}.initial_modes[{}].mode = {}: moves no node (a mode of torsion), so that no "
            "speed sets its size",
            arm.name, k, mode.number));
      }
      for (int i = 1; i <= arm.elements; ++i) {
        state->velocity.segment<6>(plant.ArmVelocity(static_cast<int>(a), i)) +=
            mode.speed_m_s / fastest * shape.segment<6>(rod.ArmVelocity(0, i));
      }
    }
  }
}

Vector6 StrainAt(const StrainTable& table, double x) {
  const auto after = std::upper_bound(table.at_m.begin(), table.at_m.end(), x);
  if (after == table.at_m.begin()) return table.strain.front();
  if (after == table.at_m.end()) return table.strain.back();
  const auto i = static_cast<std::size_t>(after - table.at_m.begin());
  const double share = (x - table.at_m[i - 1]) / (table.at_m[i] - table.at_m[i - 1]);
  return table.strain[i - 1] + share * (table.strain[i] - table.strain[i - 1]);
}

// Nodes of an arm of given strains, from its base outwards: fourth-order Magnus steps.
void PoseByStrains(const Plant& plant, int a, const StrainTable& table, PlantState* state) {
  const Rod& rod = plant.rods[a];
  const double offset = std::sqrt(3.0) / 6.0;
  for (int i = 0; i < rod.element_count(); ++i) {
    Pose g = state->pose[plant.ArmPose(a, i)];
    const double h = rod.elements[i].length / kSubsteps;
    for (int k = 0; k < kSubsteps; ++k) {
      const double mid = rod.x_m[i] + (k + 0.5) * h;
      const Vector6 x = StrainAt(table, mid - offset * h), y = StrainAt(table, mid + offset * h);
      g = g * ExpSE3(0.5 * h * (x + y) +
                     (std::sqrt(3.0) / 12.0) * h * h * SmallAdjointTimes(x, y));
    }
    g.rotation.normalize();
    state->pose[plant.ArmPose(a, i + 1)] = g;
  }
}

// Velocities of the arms as parts of one rigid body with the root, and the arms' own twists.
void MoveWithRoot(const Plant& plant, PlantState* state) {
  const Vector6 root_twist = state->velocity.head<6>();
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    const Rod& rod = plant.rods[a];
    const Pose root = plant.exact() ? state->pose[0] : Pose::Identity();
    for (int i = 1; i <= rod.element_count(); ++i) {
      const Pose from_root = Inverse(root) * state->pose[plant.ArmPose(a, i)];
      auto v = state->velocity.segment<6>(plant.ArmVelocity(a, i));
      v.setZero();
      if (plant.exact()) v = AdjointInverseTimes(from_root, root_twist);
      v += AdjointInverseTimes(Inverse(rod.mount) * from_root, plant.robot.arms[a].initial_twist);
    }
  }
}

void TakeEquilibrium(const Plant& plant, StaticsSettings settings, PlantState* state) {
  const char* where = "robot.initial = \"static\": ";
  if (plant.root_free()) {
    throw BadRobot(std::string(where) +
                   "robot.root = \"free\": needs a held root (\"clamped\" or a prescribed motion): a "
                   "free robot has no unique equilibrium");
  }
  settings.time_s = state->time_s;
  settings.max_load_factor = 1.0;
  settings.arc_length = false;
  const StaticsResult result = SolveStatics(plant, settings);
  if (!result.ok) throw BadRobot(where + result.reason);
  state->pose = result.state.pose;
  state->shape = result.state.shape;
  MoveWithRoot(plant, state);
}

}  // namespace

PlantState StartState(const Plant& plant, const StaticsSettings& statics) {
  PlantState state = InitialState(plant);
  if (plant.robot.initial == InitialShape::kEquilibrium) {
    TakeEquilibrium(plant, statics, &state);
  } else {
    bool given = false;
    for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
      const auto& table = plant.robot.arms[a].initial_strain;
      if (table) PoseByStrains(plant, a, *table, &state);
      given |= table.has_value();
    }
    if (given) MoveWithRoot(plant, &state);
  }
  AddModeVelocity(plant, &state);
  AddModesByNumber(plant, &state);
  return state;
}

}  // namespace mantle::model
