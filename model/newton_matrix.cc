#include "model/newton_matrix.h"

#include "model/dense_algebra.h"

namespace mantle::model {

NewtonMatrix::NewtonMatrix(const Plant& plant) {
  const auto size_border = [](Border* b, int n, int base, int p) {
    b->column.setZero(n, p);
    b->row.setZero(n, p);
    b->base_column.setZero(base, p);
    b->base_row.setZero(base, p);
    b->solved.setZero(n, p);
    b->schur_inverse.setZero(p, p);
    b->t.setZero(p, base);
    b->q.setZero(base, p);
    b->schur.setIdentity(p, p);
    b->scaled.setZero(p, base);
    if (p > 0) b->lu.compute(b->schur);
    b->u.setZero(p);
    b->reduced.setZero(p);
    b->active = p;
  };
  int strains = 0;
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    const Rod& rod = plant.rods[a];
    const int blocks = rod.element_count() + 1;
    ArmPart part;
    part.chain = BlockTridiagonal<6>(blocks);
    for (std::size_t c = 0; c < rod.cables.size(); ++c) part.cables.push_back(static_cast<int>(c));
    const int p = static_cast<int>(part.cables.size());
    size_border(&part.border, 6 * blocks, 6, p);
    part.response.setZero(p > 0 ? 6 * blocks : 0, 6);
    part.rhs.setZero(6 * blocks);
    part.adjoint = Adjoint(Inverse(rod.mount));
    part.strain = StrainChain(plant.root_free() ? 0 : blocks - 1);
    part.solved_strains.setZero(6 * (blocks - 1), p);
    part.first_strain = strains;
    strains += 6 * (blocks - 1);
    arms_.push_back(std::move(part));
  }
  strains_.setZero(strains);
  if (!plant.shell) return;
  const int n = plant.shell->node_count();
  const int p = kShellLoadBorders + static_cast<int>(plant.shell->spokes.size());
  shell_.chain = BlockTridiagonal<3>(n);
  size_border(&shell_.border, 3 * n, 1, p);
  shell_.coupling.setZero(3 * n);
  shell_.response.setZero(3 * n);
  shell_.rhs.setZero(3 * n);
}

bool NewtonMatrix::Border::FactorSchur() {
  schur.setIdentity();
  schur.noalias() -= row.transpose() * solved;
  lu.compute(schur);
  schur.setIdentity();
  schur_inverse.noalias() = lu.solve(schur);  // not in place: that would allocate
  scaled.noalias() = schur_inverse * t;
  return schur_inverse.allFinite();
}

bool NewtonMatrix::FactorStrains(ArmPart* part) {
  if (!part->strain.Factor()) return false;
  const int p = static_cast<int>(part->cables.size());
  Border& b = part->border;
  bool any = false;
  for (int k = 0; k < p; ++k) any = any || !b.row.col(k).isZero(0.0);
  b.active = any ? p : 0;
  if (b.active == 0) return true;
  const auto n = part->solved_strains.rows();
  b.solved.setZero();
  for (int k = 0; k < p; ++k) {
    part->strain.Solve(b.column.col(k).tail(n), b.solved.col(k).tail(n),
                       part->solved_strains.col(k));
  }
  b.t.setZero();
  return b.FactorSchur();
}

// The arm's part of a solve about rest with a held root: x = y - Z u, u = -S^-1 row^T y.
void NewtonMatrix::SolveStrains(const Plant& plant, int a, VectorX* x) {
  ArmPart& part = arms_[a];
  const auto n = part.solved_strains.rows();
  auto mine = x->segment(plant.ArmVelocity(a, 1), n);
  auto strains = strains_.segment(part.first_strain, n);
  part.rhs.head<6>().setZero();
  part.strain.Solve(mine, part.rhs.tail(n), strains);
  if (Border& b = part.border; b.active > 0) {
    b.reduced.noalias() = -(b.row.transpose() * part.rhs);
    b.u.noalias() = b.schur_inverse * b.reduced;
    part.rhs.noalias() -= b.solved * b.u;
    strains.noalias() -= part.solved_strains * b.u;
  }
  mine = part.rhs.tail(n);
}

bool NewtonMatrix::FactorArm(const Plant& plant, int a) {
  ArmPart& part = arms_[a];
  if (strain_coordinates_) return FactorStrains(&part);
  if (!part.chain.Factor(1)) return false;
  const int p = static_cast<int>(part.cables.size());
  Border& b = part.border;
  bool any = false;
  for (int k = 0; k < p; ++k) any = any || !b.row.col(k).isZero(0.0);
  b.active = any ? p : 0;
  const bool coupled = plant.exact() && plant.root_free();
  Matrix6 base = part.chain.diagonal[0];
  if (b.active > 0) {
    b.solved = b.column;
    for (int k = 0; k < p; ++k) {
      b.solved.col(k).head<6>().setZero();
      part.chain.Eliminate(1, b.solved.col(k));
      // block 0 now holds -A_01 (...): what the chain's part of the column does to the base
      b.q.col(k) = b.column.col(k).head<6>() + b.solved.col(k).head<6>();
      b.solved.col(k).head<6>().setZero();
      part.chain.Substitute(1, b.solved.col(k));
    }
    for (int k = 0; k < 6; ++k) {
      part.response.col(k).setZero();
      part.response(k, k) = 1.0;
      part.chain.Substitute(1, part.response.col(k));
    }
    b.t.noalias() = b.row.transpose() * part.response;  // base's own entries included: row 0 x I
    if (!b.FactorSchur()) return false;
    base.noalias() -= b.q * b.scaled;
  }
  if (coupled) root_.noalias() += part.adjoint.transpose() * base * part.adjoint;
  return true;
}

bool NewtonMatrix::FactorShell(const Plant&) {
  if (!shell_.chain.Factor(0)) return false;
  Border& b = shell_.border;
  const int p = static_cast<int>(b.column.cols());
  b.solved = b.column;
  for (int k = 0; k < p; ++k) {
    shell_.chain.Eliminate(0, b.solved.col(k));
    shell_.chain.Substitute(0, b.solved.col(k));
  }
  // Base unknown: the root's axial increment x0; chain: x = y - Z u - response x0
  shell_.response = shell_.coupling;
  shell_.chain.Eliminate(0, shell_.response);
  shell_.chain.Substitute(0, shell_.response);
  b.t = b.base_row.transpose();
  b.t.noalias() -= b.row.transpose() * shell_.response;
  b.q = b.base_column;
  b.q.noalias() -= shell_.coupling.transpose() * b.solved;
  if (!b.FactorSchur()) return false;
  shell_.coupling_pivot = -shell_.coupling.dot(shell_.response) - b.q.row(0).dot(b.scaled.col(0));
  root_(5, 5) += shell_.coupling_pivot;
  return true;
}

bool NewtonMatrix::Factor(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                          const PlantWork& work, const VectorX& acceleration, double s,
                          double chart) {
  return FactorAbout(plant, state, inputs, work, {s, chart, &acceleration});
}

bool NewtonMatrix::FactorAtRest(const Plant& plant, const PlantState& state,
                                const PlantInputs& inputs, const PlantWork& work, double s) {
  return FactorAbout(plant, state, inputs, work, {s, 1.0, nullptr});
}

bool NewtonMatrix::FactorAbout(const Plant& plant, const PlantState& state,
                               const PlantInputs& inputs, const PlantWork& work,
                               const Linearisation& at) {
  strain_coordinates_ = at.rest() && !plant.root_free();
  const double s = at.s, chart = at.chart;
  const Vector6 eta = state.velocity.head<6>();
  root_ = (s * s) * work.root_mass;
  if (s > 0.0) {
    const Matrix6 ad = SmallAdjoint(eta);
    root_ += (chart * s) * work.root_mass * ad;
    root_ -= s * (ad.transpose() * work.root_mass + CoadjointMatrix(work.root_mass * eta));
  }
  // What drag does to the root in s is small beside the mass, and left to the correction.
  root_.leftCols<3>() -=
      RootLoadTangent(plant.root_loads,
                      {state.pose[0].rotation, eta, inputs.water_acceleration_m_s2},
                      inputs.gravity_scale)
          .by_rotation;
  for (int a = 0; a < static_cast<int>(arms_.size()); ++a) {
    AssembleArm(plant, a, state, inputs, work, at);
    if (!FactorArm(plant, a)) return false;
  }
  if (plant.shell) {
    AssembleShell(plant, state, inputs, work, at);
    if (!FactorShell(plant)) return false;
  }
  if (!plant.root_free()) return true;
  root_inverse_ = root_.inverse();
  return root_inverse_.allFinite();
}

void NewtonMatrix::Solve(const Plant& plant, VectorX* x, VectorX* tensions) {
  const bool root_free = plant.root_free();
  const bool coupled = plant.exact() && root_free;
  Vector6 root = x->head<6>();
  for (int a = 0; a < static_cast<int>(arms_.size()); ++a) {
    if (strain_coordinates_) {
      SolveStrains(plant, a, x);
      continue;
    }
    ArmPart& part = arms_[a];
    const int n = 6 * (part.chain.size() - 1);
    part.rhs.head<6>().setZero();
    part.rhs.tail(n) = x->segment(plant.ArmVelocity(a, 1), n);
    part.chain.Eliminate(1, part.rhs);
    Vector6 base = part.rhs.head<6>();
    if (part.border.active > 0) {
      Border& b = part.border;
      part.rhs.head<6>().setZero();
      part.chain.Substitute(1, part.rhs);  // y, with x0 = 0
      b.reduced.noalias() = b.row.transpose() * part.rhs;
      b.reduced = -b.reduced;
      if (tensions != nullptr) {
        b.reduced += tensions->segment(plant.ArmCableIndex(a, 0), b.reduced.size());
      }
      b.u.noalias() = b.schur_inverse * b.reduced;
      base.noalias() -= b.q * b.u;
    }
    if (coupled) root.noalias() += part.adjoint.transpose() * base;
  }
  if (plant.shell) {
    Border& b = shell_.border;
    shell_.rhs = x->tail(shell_.rhs.size());
    for (int j : {0, plant.shell->element_count()}) {
      shell_.rhs.segment<3>(3 * j).array() *= 1.0 - plant.shell->nodes[j].held.array();
    }
    shell_.chain.Eliminate(0, shell_.rhs);
    shell_.chain.Substitute(0, shell_.rhs);
    b.reduced.noalias() = b.row.transpose() * shell_.rhs;
    b.reduced = -b.reduced;
    const auto spokes = b.reduced.size() - kShellLoadBorders;
    if (tensions != nullptr && spokes > 0) {
      b.reduced.tail(spokes) += tensions->segment(plant.SpokeIndex(0), spokes);
    }
    b.u.noalias() = b.schur_inverse * b.reduced;
    root(5) -= shell_.coupling.dot(shell_.rhs) + b.q.row(0).dot(b.u);
  }
  if (root_free) {
    x->head<6>().noalias() = root_inverse_ * root;
  } else {
    x->head<6>().setZero();
  }
  const Vector6 root_x = x->head<6>();
  for (int a = 0; a < static_cast<int>(arms_.size()) && !strain_coordinates_; ++a) {
    ArmPart& part = arms_[a];
    const int n = 6 * (part.chain.size() - 1);
    Vector6 x0 = Vector6::Zero();
    if (coupled) x0 = part.adjoint * root_x;
    if (part.border.active > 0) {
      Border& b = part.border;
      b.reduced.noalias() -= b.t * x0;
      b.u.noalias() = b.schur_inverse * b.reduced;
      part.rhs.noalias() -= b.solved * b.u;
      part.rhs.noalias() += part.response * x0;
      if (tensions != nullptr) tensions->segment(plant.ArmCableIndex(a, 0), b.u.size()) = b.u;
    } else {
      part.rhs.head<6>() = x0;
      part.chain.Substitute(1, part.rhs);
    }
    x->segment(plant.ArmVelocity(a, 1), n) = part.rhs.tail(n);
  }
  if (plant.shell) {
    Border& b = shell_.border;
    b.reduced.noalias() -= b.t.col(0) * root_x(5);
    b.u.noalias() = b.schur_inverse * b.reduced;
    shell_.rhs.noalias() -= b.solved * b.u;
    shell_.rhs.noalias() -= shell_.response * root_x(5);
    const auto spokes = b.u.size() - kShellLoadBorders;
    if (tensions != nullptr && spokes > 0) {
      tensions->segment(plant.SpokeIndex(0), spokes) = b.u.tail(spokes);
    }
    x->tail(shell_.rhs.size()) = shell_.rhs;
  }
}

double NewtonMatrix::TensionShare(const Plant& plant, int cable) const {
  const auto of = [](const Border& b, int k) {
    return b.active > 0 ? std::abs(b.schur_inverse(k, k)) : 1.0;
  };
  for (int a = static_cast<int>(arms_.size()) - 1; a >= 0; --a) {
    const int k = cable - plant.ArmCableIndex(a, 0);
    if (k >= 0 && k < static_cast<int>(arms_[a].cables.size())) return of(arms_[a].border, k);
  }
  return of(shell_.border, kShellLoadBorders + cable - plant.SpokeIndex(0));
}

int NewtonMatrix::NegativeEigenvalues() const {
  // A body with extra unknowns has A + sum_k column_k k_k column_k^T, k_k > 0 the cables'
  // stiffnesses; with S = 1 - row^T A^-1 column (similar to a symmetric matrix) Haynsworth's
  // inertia formula takes the negative eigenvalues of S off those of the chain.
  const auto lifted = [](const Border& b) {
    if (b.active == 0 || b.schur_inverse.size() == 0) return 0;
    return static_cast<int>((EigenvaluesOf(b.schur_inverse).real().array() < 0.0).count());
  };
  int negative = 0;
  for (const ArmPart& part : arms_) {
    negative += strain_coordinates_ ? part.strain.NegativePivots() : part.chain.NegativePivots(1);
    negative -= lifted(part.border);
  }
  if (shell_.chain.size() > 0) negative += shell_.chain.NegativePivots(0) - lifted(shell_.border);
  return negative;
}

}  // namespace mantle::model
