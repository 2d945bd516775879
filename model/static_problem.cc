#include "model/static_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mantle::model {
namespace {

// Change of an element's d under body increments of its two nodes.
Vector6 StrainIncrement(const RodElementState& e, const Vector6& zeta1, const Vector6& zeta2) {
  return e.even.Times(zeta2 - zeta1) + 0.5 * SmallAdjointTimes(e.d, zeta1 + zeta2);
}

}  // namespace

bool FeelsCurrent(const Effects& effects) {
  bool feels = effects.drag || effects.added_mass;
  effects.named.ForEach([&](const auto& effect) {
    feels |= effect.has_value() && EffectType<decltype(effect)>::kOnVelocity;
  });
  return feels;
}

StaticProblem::StaticProblem(const Plant& plant, double time_s) : plant_(plant), time_s_(time_s) {
  if (plant.root_free()) {
    throw BadRobot(
        "robot.root = \"free\": statics needs a held root (\"clamped\" or a prescribed motion), a "
        "free robot has no unique equilibrium");
  }
  EvaluateInputs(plant, time_s, false, &full_);
  const WaterMotion water = EvaluateWater(plant.robot.effects, time_s);
  const Vector3& current = water.velocity_m_s;
  full_.root_pose.position += water.drift_m;  // back from the frame that drifts
  full_.water_acceleration_m_s2.setZero();
  full_.root_twist.setZero();
  full_.root_acceleration.setZero();
  if (FeelsCurrent(plant.robot.effects)) current_m_s_ = current;
  for (const Rod& rod : plant.rods) path_size_ += 6 * rod.element_count();
  path_size_ += 3 * plant.shape_count();
}

StaticState StaticProblem::Reference() const {
  StaticState state{InitialState(plant_, time_s_), {}};
  state.time_s = time_s_;
  state.velocity.setZero();
  ImposeRoot(plant_, full_, &state);
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    const Rod& rod = plant_.rods[a];
    const Pose base = state.pose[0] * rod.mount;
    for (int i = 0; i <= rod.element_count(); ++i) {
      state.pose[plant_.ArmPose(a, i)] = base * rod.reference[i];
    }
    state.extension.emplace_back(rod.element_count(), Vector6::Zero());
  }
  return state;
}

void ScaleLoads(const Plant& plant, double factor, PlantInputs* inputs) {
  inputs->gravity_scale = factor;
  inputs->normal_pressure_pa *= factor;
  inputs->water_acceleration_m_s2 *= factor;
  for (double& x : inputs->distributed) x *= factor;
  for (double& x : inputs->points) x *= factor;
  for (double& x : inputs->strips_pa) x *= factor;
  for (MuscleInput& m : inputs->muscles) m.amplitude_n_m *= factor;
  int at = 0;
  const auto rest = [&](double length) {
    CableInput& c = inputs->cables[at++];
    c.tension_n *= factor;
    c.reel_m = length + factor * (c.reel_m - length);
    c.reel_rate_m_s = 0;
  };
  for (const Rod& rod : plant.rods) {
    for (const RodCable& c : rod.cables) rest(c.rest_length_m);
  }
  if (plant.shell) {
    for (const ShellSpokes& s : plant.shell->spokes) rest(s.rest_length_m);
  }
}

void StaticProblem::Scale(double factor, PlantInputs* inputs) const {
  *inputs = full_;
  ScaleLoads(plant_, factor, inputs);
  const double speed = std::copysign(std::sqrt(std::abs(factor)), factor);
  inputs->root_twist.tail<3>() = -speed * (full_.root_pose.rotation.conjugate() * current_m_s_);
}

EvaluationFailure StaticProblem::Evaluate(double factor, StaticState* state, PlantInputs* inputs,
                                          PlantWork* work) const {
  Scale(factor, inputs);
  ImposeRoot(plant_, *inputs, state);
  if (!current_m_s_.isZero(0.0)) {
    const Vector3 drift = state->pose[0].rotation * inputs->root_twist.tail<3>();
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      for (int i = 1; i <= plant_.rods[a].element_count(); ++i) {
        auto v = state->velocity.segment<6>(plant_.ArmVelocity(a, i));
        v.head<3>().setZero();
        v.tail<3>() = state->pose[plant_.ArmPose(a, i)].rotation.conjugate() * drift;
      }
    }
  }
  const EvaluationFailure failure = EvaluateForces(plant_, *state, *inputs, work);
  if (failure) return failure;
  // Stresses of the strains kept in the place of those read back from the poses.
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    const Rod& rod = plant_.rods[a];
    for (int i = 0; i < rod.element_count(); ++i) {
      const RodElement& e = rod.elements[i];
      RodElementState& s = work->rod[a][i];
      const Vector6 read = s.d - e.length * e.reference_strain;
      const Vector6 change = state->extension[a][i] - read;
      Vector6 stress = e.stiffness.cwiseProduct(change) / e.length;
      if (!rod.coupling.empty()) stress += rod.coupling[i] * change / e.length;
      Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
      AddRodElementForces(s, stress, &f1, &f2);
      if (i > 0) work->force.segment<6>(plant_.ArmVelocity(a, i)) += f1;
      work->force.segment<6>(plant_.ArmVelocity(a, i + 1)) += f2;
    }
  }
  work->force.head<6>().setZero();
  return {};
}

void StaticProblem::Solve(const VectorX& force, NewtonMatrix* matrix, StaticStep* step) const {
  step->zeta = force;
  matrix->Solve(plant_, &step->zeta);
  step->strain = matrix->strain_increments();
}

StaticStep StaticProblem::StepOf(const PlantWork& work, const VectorX& zeta) const {
  StaticStep step{zeta, VectorX::Zero(path_size_ - 3 * plant_.shape_count())};
  int at = 0;
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    Vector6 before = Vector6::Zero();
    for (int i = 0; i < plant_.rods[a].element_count(); ++i, at += 6) {
      const Vector6 after = zeta.segment<6>(plant_.ArmVelocity(a, i + 1));
      step.strain.segment<6>(at) = StrainIncrement(work.rod[a][i], before, after);
      before = after;
    }
  }
  return step;
}

void StaticProblem::Move(const StaticState& from, const StaticStep& step, double alpha,
                         StaticState* to) const {
  *to = from;
  int strain = 0;
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    const Rod& rod = plant_.rods[a];
    for (int i = 0; i < rod.element_count(); ++i, strain += 6) {
      const RodElement& e = rod.elements[i];
      Vector6& extension = to->extension[a][i];
      extension += alpha * step.strain.segment<6>(strain);
      const Vector6 d = e.length * e.reference_strain + extension;
      const int at = plant_.ArmPose(a, i);
      to->pose[at + 1] = to->pose[at] * ExpSE3(d);
      to->pose[at + 1].rotation.normalize();
    }
  }
  for (int j = 0; j < plant_.shape_count(); ++j) {
    to->shape[j] = from.shape[j] + alpha * step.zeta.segment<3>(plant_.ShellVelocity(j));
  }
}

double StaticProblem::Size(const VectorX& zeta) const {
  double angular = 0, linear = 0;
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    for (int i = 1; i <= plant_.rods[a].element_count(); ++i) {
      const int at = plant_.ArmVelocity(a, i);
      angular = std::max(angular, zeta.segment<3>(at).cwiseAbs().maxCoeff());
      linear = std::max(linear, zeta.segment<3>(at + 3).cwiseAbs().maxCoeff());
    }
  }
  for (int j = 0; j < plant_.shape_count(); ++j) {
    const int at = plant_.ShellVelocity(j);
    linear = std::max(linear, zeta.segment<2>(at).cwiseAbs().maxCoeff());
    angular = std::max(angular, std::abs(zeta(at + 2)));
  }
  const double size = std::max(angular, linear / plant_.body_length_m);
  return zeta.allFinite() ? size : std::numeric_limits<double>::infinity();
}

void StaticProblem::PathIncrement(const StaticStep& step, VectorX* path) const {
  path->setZero(path_size_);
  int at = 0;
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    const Rod& rod = plant_.rods[a];
    const double length = rod.x_m.back();
    for (int i = 0; i < rod.element_count(); ++i, at += 6) {
      const double weight = std::sqrt(length / rod.elements[i].length);
      const Vector6 d = weight * step.strain.segment<6>(at);
      path->segment<3>(at) = d.head<3>();
      path->segment<3>(at + 3) = d.tail<3>() / length;
    }
  }
  const double weight = 1.0 / std::sqrt(std::max(plant_.shape_count(), 1));
  for (int j = 0; j < plant_.shape_count(); ++j, at += 3) {
    const Vector3 q = step.zeta.segment<3>(plant_.ShellVelocity(j));
    path->segment<2>(at) = (weight / plant_.body_length_m) * q.head<2>();
    (*path)(at + 2) = weight * q(2);
  }
}

}  // namespace mantle::model
