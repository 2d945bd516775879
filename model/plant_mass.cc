#include <limits>

#include "model/plant.h"

/// The mass matrix: its product, and its solution in O(N).

namespace mantle::model {
namespace {

// Eliminates an arm's mass and forces from its tip; what is left belongs to node 0.
void EliminateArmMass(const Plant& plant, int a, PlantWork* work) {
  const Rod& rod = plant.rods[a];
  BlockTridiagonal<6>& chain = work->mass[a];
  VectorX& rhs = work->mass_rhs[a];
  const int n = rod.element_count();
  chain.diagonal[0].setZero();
  for (int i = 1; i <= n; ++i) chain.diagonal[i] = rod.nodes[i].FullInertia().asDiagonal();
  for (int i = 0; i < n; ++i) {
    const RodNode& place = rod.middles[i];
    Matrix6 inertia = place.FullInertia().asDiagonal();
    FormFromAhead(place.ahead_m, &inertia);
    const MiddleBlocks b = MiddleForm(work->rod[a][i].middle, inertia);
    chain.diagonal[i] += b.a11;
    chain.upper[i] = b.a12;
    chain.lower[i] = b.a21;
    chain.diagonal[i + 1] += b.a22;
  }
  for (std::size_t k = 0; k < rod.payloads.size(); ++k) {
    const RodPayload& p = rod.payloads[k];
    if (p.node == 0) continue;  // in the root's
    chain.diagonal[p.node] +=
        work->payloads[plant.PayloadIndex(a, static_cast<int>(k))] * p.inertia;
  }
  rhs.head<6>().setZero();
  rhs.tail(6 * n) = work->force.segment(plant.ArmVelocity(a, 1), 6 * n);
  if (chain.Factor(1)) {
    chain.Eliminate(1, rhs);
  } else {  // no mass: nor is there an acceleration
    rhs.setConstant(std::numeric_limits<double>::infinity());
  }
}

}  // namespace

void ApplyMass(const Plant& plant, const PlantWork& work, const VectorX& a, VectorX* out) {
  const Vector6 root = a.head<6>();
  out->head<6>().noalias() = work.root_mass * root;
  for (int k = 0; k < static_cast<int>(plant.rods.size()); ++k) {
    const Rod& rod = plant.rods[k];
    for (int i = 1; i <= rod.element_count(); ++i) {
      const int at = plant.ArmVelocity(k, i);
      out->segment<6>(at) = rod.nodes[i].FullInertia().cwiseProduct(a.segment<6>(at));
    }
    for (std::size_t p = 0; p < rod.payloads.size(); ++p) {
      if (rod.payloads[p].node == 0) continue;  // in the root's
      const int at = plant.ArmVelocity(k, rod.payloads[p].node);
      out->segment<6>(at) += work.payloads[plant.PayloadIndex(k, static_cast<int>(p))] *
                             (rod.payloads[p].inertia * a.segment<6>(at));
    }
    Vector6 before = Vector6::Zero();
    if (plant.exact()) before = AdjointInverseTimes(rod.mount, root);
    for (int i = 0; i < rod.element_count(); ++i) {
      const RodMiddle& m = work.rod[k][i].middle;
      const int at = plant.ArmVelocity(k, i + 1);
      const Vector6 after = a.segment<6>(at);
      Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
      AddMiddleWrench(
          rod.middles[i], m,
          rod.middles[i].FullInertia().cwiseProduct(MiddleTwist(rod.middles[i], m, before, after)),
          &f1, &f2);
      if (i > 0) {
        out->segment<6>(at - 6) += f1;
      } else if (plant.exact()) {
        out->head<6>() += AdjointInverseTransposeTimes(rod.mount, f1);
      }
      out->segment<6>(at) += f2;
      before = after;
    }
  }
  if (!plant.shell) return;
  const double axial = plant.exact() ? root(5) : 0.0;
  double sum = 0;
  for (int j = 0; j < plant.shell->node_count(); ++j) {
    const ShellNode& node = plant.shell->nodes[j];
    const int at = plant.ShellVelocity(j);
    const Vector3 free = Vector3::Ones() - node.held;
    Vector3 total = a.segment<3>(at);
    sum += free(1) * node.inertia(1) * total(1);
    total(1) += axial;
    out->segment<3>(at) = node.inertia.cwiseProduct(total).cwiseProduct(free);
  }
  if (plant.exact()) (*out)(5) += sum;
}

void SolveAcceleration(const Plant& plant, const PlantInputs& inputs, PlantWork* work, VectorX* a) {
  Vector6 rhs = work->force.head<6>();
  Matrix6 schur = work->root_mass;
  const bool coupled = plant.shell && plant.exact();
  if (coupled) {
    for (int j = 0; j < plant.shell->node_count(); ++j) {
      const ShellNode& node = plant.shell->nodes[j];
      if (node.held(1) != 0.0) continue;
      schur(5, 5) -= node.inertia(1);
      rhs(5) -= work->force(plant.ShellVelocity(j) + 1);
    }
  }
  for (int k = 0; k < static_cast<int>(plant.rods.size()); ++k) {
    EliminateArmMass(plant, k, work);
    if (!plant.exact()) continue;
    const Matrix6 ad = Adjoint(Inverse(plant.rods[k].mount));
    schur += ad.transpose() * work->mass[k].diagonal[0] * ad;
    rhs += ad.transpose() * work->mass_rhs[k].head<6>();
  }
  if (plant.root_free()) {
    a->head<6>() = schur.ldlt().solve(rhs);
  } else {
    a->head<6>() = inputs.root_acceleration;
  }
  for (int k = 0; k < static_cast<int>(plant.rods.size()); ++k) {
    VectorX& x = work->mass_rhs[k];
    x.head<6>().setZero();
    if (plant.exact()) x.head<6>() = AdjointInverseTimes(plant.rods[k].mount, a->head<6>());
    work->mass[k].Substitute(1, x);
    const int n = 6 * plant.rods[k].element_count();
    a->segment(plant.ArmVelocity(k, 1), n) = x.tail(n);
  }
  if (!plant.shell) return;
  for (int j = 0; j < plant.shell->node_count(); ++j) {
    const ShellNode& node = plant.shell->nodes[j];
    const int at = plant.ShellVelocity(j);
    Vector3 x = work->force.segment<3>(at).cwiseQuotient(node.inertia);
    if (coupled) x(1) -= (*a)(5);
    a->segment<3>(at) = x.cwiseProduct(Vector3::Ones() - node.held);
  }
}

}  // namespace mantle::model
