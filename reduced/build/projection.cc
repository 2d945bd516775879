#include "reduced/build/projection.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "reduced/build/arm.h"

namespace mantle::reduced {
namespace {

constexpr int kIterations = 60;
constexpr double kConverged = 1e-13;  // change of strain, relative to 1/length or 1
constexpr double kAccepted = 1e-9;    // where round-off keeps the change above kConverged

}  // namespace

Projection::Projection(const ReducedPlant& model)
    : model_(model),
      trial_(InitialState(model.plant)),
      zero_(VectorX::Zero(model.velocity_count())) {
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    const ReducedArm& arm = model.arms[a];
    const model::Rod& rod = model.plant.rods[a];
    ArmReduction nodes = arm.reduction;
    nodes.rule = SectionRule::kPlantNodes;
    lifting_.push_back(MakeReducedArm(model.plant, a, nodes));
    lifting_.back().loads.clear();
    lifting_.back().distributed.clear();
    lifting_.back().points.clear();
    lifting_.back().cables.clear();
    lifting_.back().payloads.clear();
    lifting_.back().muscles.clear();
    lifting_.back().muscle_points.clear();
    lifting_.back().needs_rotation = false;
    std::vector<Matrix6X> rows;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(arm.size(), arm.size());
    Matrix6X local;
    for (int i = 0; i < rod.element_count(); ++i) {
      const double x = 0.5 * (rod.x_m[i] + rod.x_m[i + 1]);
      const int g = arm.basis.GroupOf(x);
      const StrainGroup& group = arm.basis.groups()[g];
      local = ReducedBasisAt(model.plant, a, arm.basis, g, x);
      Matrix6X b = Matrix6X::Zero(6, arm.size());
      b.middleCols(group.first, group.columns) = local;
      const double l = rod.elements[i].length;
      normal += l * b.transpose() * rod.elements[i].stiffness.asDiagonal() * b;
      // rows^T d = l B^T Sigma (d / l)
      rows.push_back(rod.elements[i].stiffness.asDiagonal() * b);
    }
    Eigen::FullPivLU<Eigen::MatrixXd> lu(normal);
    if (!lu.isInvertible()) {
      throw model::BadRobot(
          fmt::format("reduced.arms.{}: {} strain coordinates; the plant's {} elements tell only "
                      "{} apart, use more elements",
                      rod.name, arm.size(), rod.element_count(), lu.rank()));
    }
    normal_inverse_.push_back(lu.inverse());
    element_basis_.push_back(std::move(rows));
    work_.emplace_back(lifting_.back());
  }
}

void Projection::Lift(const ReducedState& from, model::PlantState* to) {
  const model::Plant& plant = model_.plant;
  to->time_s = from.time_s;
  to->pose[0] = from.root;
  to->velocity.head<6>() = from.v.head<6>();
  for (int a = 0; a < static_cast<int>(lifting_.size()); ++a) {
    const int first = model_.arm_first(a);
    const ArmMotion motion{from.q.data() + first,
                           from.v.data() + 6 + first,
                           zero_.data() + 6 + first,
                           from.v.head<6>(),
                           Vector6::Zero(),
                           from.root.rotation,
                           1.0,
                           nullptr,
                           nullptr,
                           nullptr};
    EvaluateArm(lifting_[a], motion, &work_[a]);
    to->pose[plant.ArmPose(a, 0)] = from.root * plant.rods[a].mount;
    for (std::size_t l = 0; l < lifting_[a].intervals.size(); ++l) {
      const int node = lifting_[a].intervals[l].section;
      if (node < 0 || node > plant.rods[a].element_count()) continue;  // inside an element
      const IntervalState& s = work_[a].at[l];
      const Pose relative{Eigen::Quaterniond(s.rotation), s.position};
      to->pose[plant.ArmPose(a, node)] = from.root * relative;
      to->velocity.segment<6>(plant.ArmVelocity(a, node)) =
          model::AdjointInverseTimes(relative, s.twist);
    }
  }
  if (!model_.mantle) return;
  const int at = model_.mantle_first();
  const auto s = from.q.segment(at, model_.mantle->size);
  const auto rate = from.v.segment(6 + at, model_.mantle->size);
  for (int j = 0; j < plant.shape_count(); ++j) {
    const auto rows = model_.mantle->basis.shapes.middleRows<3>(3 * j);
    to->shape[j] = model_.mantle->reference[j];
    to->shape[j].noalias() += rows.lazyProduct(s);
    to->velocity.segment<3>(plant.ShellVelocity(j)).noalias() = rows.lazyProduct(rate);
  }
}

bool Projection::ProjectArm(int a, const model::PlantState& from, ReducedState* to) {
  const model::Plant& plant = model_.plant;
  const model::Rod& rod = plant.rods[a];
  const int n = model_.arms[a].size(), first = model_.arm_first(a);
  const Vector6 base_twist =
      model::AdjointInverseTimes(rod.mount, Vector6(from.velocity.head<6>()));
  double size = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Lift(*to, &trial_);
    VectorX strain = VectorX::Zero(n), rate = VectorX::Zero(n);
    const auto twist = [&](const model::PlantState& s, int node) -> Vector6 {
      if (node == 0) return base_twist;
      return s.velocity.segment<6>(plant.ArmVelocity(a, node));
    };
    for (int i = 0; i < rod.element_count(); ++i) {
      model::RodElementState want, have;
      const auto evaluate = [&](const model::PlantState& s, model::RodElementState* e) {
        return EvaluateRodElement(s.pose[plant.ArmPose(a, i)], s.pose[plant.ArmPose(a, i + 1)],
                                  twist(s, i), twist(s, i + 1), e);
      };
      if (!evaluate(from, &want) || !evaluate(trial_, &have)) return false;
      strain += element_basis_[a][i].transpose() * (want.d - have.d);
      rate += element_basis_[a][i].transpose() * (want.d_dot - have.d_dot);
    }
    strain = normal_inverse_[a] * strain;
    rate = normal_inverse_[a] * rate;
    to->q.segment(first, n) += strain;
    to->v.segment(6 + first, n) += rate;
    const double scale = 1.0 + to->q.segment(first, n).cwiseAbs().maxCoeff();
    const double rate_scale = 1.0 + to->v.segment(6 + first, n).cwiseAbs().maxCoeff();
    size = std::max(strain.cwiseAbs().maxCoeff() / scale, rate.cwiseAbs().maxCoeff() / rate_scale);
    if (!std::isfinite(size)) return false;
    if (size < kConverged) return true;
  }
  return size < kAccepted;
}

bool Projection::Project(const model::PlantState& from, ReducedState* to) {
  if (from.pose.size() != trial_.pose.size() || from.velocity.size() != trial_.velocity.size() ||
      from.shape.size() != trial_.shape.size()) {
    return false;
  }
  to->q.resize(model_.coordinate_count());
  to->v.resize(model_.velocity_count());
  to->time_s = from.time_s;
  to->root = from.pose[0];
  to->q.setZero();
  to->v.setZero();
  to->v.head<6>() = from.velocity.head<6>();
  if (model_.mantle) {
    const ReducedMantle& m = *model_.mantle;
    const int at = model_.mantle_first();
    for (int j = 0; j < model_.plant.shape_count(); ++j) {
      const auto rows = m.basis.shapes.middleRows<3>(3 * j).transpose();
      const Vector3 mass = model_.plant.shell->nodes[j].inertia;
      const Vector3 rate = from.velocity.segment<3>(model_.plant.ShellVelocity(j));
      to->q.segment(at, m.size) += rows * mass.cwiseProduct(from.shape[j] - m.reference[j]);
      to->v.segment(6 + at, m.size) += rows * mass.cwiseProduct(rate);
    }
  }
  for (int a = 0; a < static_cast<int>(model_.arms.size()); ++a) {
    if (!ProjectArm(a, from, to)) return false;
  }
  return true;
}

}  // namespace mantle::reduced
