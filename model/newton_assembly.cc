#include <cmath>

#include "model/newton_matrix.h"

/// Assembly of the iteration matrix, body by body; its elimination is in newton_matrix.cc.

namespace mantle::model {

void NewtonMatrix::AssembleArm(const Plant& plant, int a, const PlantState& state,
                               const PlantInputs& inputs, const PlantWork& work,
                               const Linearisation& at) {
  const bool rest = at.rest();
  const double s = at.s, chart = at.chart;
  const Rod& rod = plant.rods[a];
  ArmPart& part = arms_[a];
  BlockTridiagonal<6>& chain = part.chain;
  const std::vector<Vector6>& twist = work.twist[a];
  const Pose* pose = &state.pose[plant.ArmPose(a, 0)];
  const int n = rod.element_count();
  for (auto& d : chain.diagonal) d.setZero();
  part.border.column.setZero();
  part.border.row.setZero();

  const Vector6 kZero = Vector6::Zero();
  RodElementTangent t;
  for (int i = 0; i < n; ++i) {
    const RodElementState& e = work.rod[a][i];
    Vector6 sigma = RodStress(rod.elements[i], e);
    AddCoupledStress(rod, i, e, work.muscles[a], &sigma);
    Matrix6 cable_tangent = Matrix6::Zero();
    bool pulled = false;
    if (!rod.coupling.empty()) {
      cable_tangent = rod.coupling[i] / rod.elements[i].length;
      pulled = true;
    }
    for (std::size_t c = 0; c < rod.cables.size(); ++c) {
      if (i >= static_cast<int>(rod.cables[c].pieces.size())) continue;
      const CableInput& in = inputs.cables[plant.ArmCableIndex(a, static_cast<int>(c))];
      const double u = work.cable_tension_n[plant.ArmCableIndex(a, static_cast<int>(c))];
      if (u == 0.0) continue;
      Vector6 gradient;
      Matrix6 hessian;
      CablePieceLength(rod.cables[c].pieces[i], rod.elements[i], e.d, &gradient, &hessian);
      sigma += u * gradient;
      cable_tangent += u * hessian;
      pulled = true;
      if (!in.reeled) continue;
      // dl = gradient . (Jr^-1 zeta2 - Jl^-1 zeta1): column of force -u dl/dq, row -(k + s d) dl/dq
      Vector6 g1 = Vector6::Zero(), g2 = Vector6::Zero();
      AddRodElementForces(e, gradient, &g1, &g2);  // forces are minus the gradient
      const int k = static_cast<int>(c);
      part.border.column.col(k).segment<6>(6 * i) -= g1;
      part.border.column.col(k).segment<6>(6 * (i + 1)) -= g2;
    }
    if (strain_coordinates_) {
      part.strain.elements[i] =
          LinearStrainElement(rod.elements[i], e, sigma, pulled ? &cable_tangent : nullptr, s);
      continue;
    }
    // About rest no strain changes but by what s zeta does: the drift is the same for both nodes.
    RodElementTangents(rod.elements[i], e, rest ? kZero : twist[i], rest ? kZero : twist[i + 1],
                       sigma, pulled ? &cable_tangent : nullptr, s, &t);
    chain.diagonal[i] += t.a11;
    chain.diagonal[i + 1] += t.a22;
    chain.upper[i] = t.a12;
    chain.lower[i] = t.a21;
  }
  for (std::size_t c = 0; c < rod.cables.size(); ++c) {
    const CableInput& in = inputs.cables[plant.ArmCableIndex(a, static_cast<int>(c))];
    if (!in.reeled) continue;
    const int k = static_cast<int>(c);
    part.border.row.col(k) = -(in.stiffness_n_m + s * in.damping_n_s_m) * part.border.column.col(k);
  }

  int first_point = 0;
  for (int b = 0; b < a; ++b) first_point += static_cast<int>(plant.rods[b].points.size());
  int first_distributed = 0;
  for (int b = 0; b < a; ++b)
    first_distributed += static_cast<int>(plant.rods[b].distributed.size());
  // Loads and inertia at a place: on its increment zeta.
  const auto add_place = [&](const RodNode& place, const Pose& g, const Vector6& eta, int node,
                             bool inertia, Matrix6* form) {
    Matrix6& d = *form;
    const Vector6 m = place.FullInertia();
    if (s > 0.0 && inertia) {  // s^2 M + chart s M ad_eta - s ad_eta^T M - s N(M eta)
      const Vector6 p = m.cwiseProduct(eta);
      const Matrix3 w = Hat(eta.head<3>()), v = Hat(eta.tail<3>());
      const Matrix3 rotary = m.head<3>().asDiagonal(), mass = m.tail<3>().asDiagonal();
      const Matrix3 force = Hat(p.tail<3>()), turning = w * mass;
      d.diagonal() += s * s * m;
      d.topLeftCorner<3, 3>() += s * (chart * (rotary * w) + w * rotary - Hat(p.head<3>()));
      d.topRightCorner<3, 3>() += s * (v * mass - force);
      d.bottomLeftCorner<3, 3>() += s * (chart * (mass * v) - force);
      d.bottomRightCorner<3, 3>() += s * (turning - chart * turning.transpose());
    }
    const bool loaded = inertia && node >= 0 && !rod.payloads.empty();
    const Matrix6 payload = loaded ? PayloadInertia(plant, work, a, node) : Matrix6::Zero();
    if (loaded && s > 0.0) {
      const Matrix6 ad = SmallAdjoint(eta);
      d += s * (s * payload + chart * payload * ad - ad.transpose() * payload -
                CoadjointMatrix(payload * eta));
    }
    SectionMotion motion{g.rotation, eta, inputs.water_acceleration_m_s2};
    if (!plant.exact()) {
      motion.rotation = state.pose[0].rotation * g.rotation;
      motion.twist += AdjointInverseTimes(g, state.velocity.head<6>());
    }
    LoadTangent lt;
    for (const SectionLoad& load : rod.loads) {
      LoadTangent one;
      std::visit([&](const auto& l) { l.AddTangent(place.section, motion, &one); }, load);
      const double scale = place.weight_m * FieldScale(load, inputs.gravity_scale);
      lt.force_by_rotation += scale * one.force_by_rotation;
      lt.moment_by_rotation += scale * one.moment_by_rotation;
      lt.force_by_velocity += scale * one.force_by_velocity;
    }
    for (std::size_t k = 0; k < rod.distributed.size(); ++k) {
      if (rod.distributed[k].load.frame == LoadFrame::kBody) continue;
      LoadTangent one;
      rod.distributed[k].load.AddTangent(place.section, motion, &one);
      const double scale = place.weight_m * inputs.distributed[first_distributed + k];
      lt.force_by_rotation += scale * one.force_by_rotation;
      lt.moment_by_rotation += scale * one.moment_by_rotation;
    }
    for (std::size_t k = 0; k < rod.points.size(); ++k) {
      if (rod.points[k].node != node || rod.points[k].load.frame == LoadFrame::kBody) continue;
      const Vector6 w = WrenchInSection(inputs.points[first_point + k] * rod.points[k].load.wrench,
                                        LoadFrame::kWorld, motion.rotation);
      lt.moment_by_rotation += Hat(w.head<3>());
      lt.force_by_rotation += Hat(w.tail<3>());
    }
    for (std::size_t k = 0; k < rod.payloads.size(); ++k) {
      if (rod.payloads[k].node != node) continue;
      const double attached = work.payloads[plant.PayloadIndex(a, static_cast<int>(k))];
      d.leftCols<3>() -=
          attached *
          RootLoadTangent(rod.payloads[k].loads, motion, inputs.gravity_scale).by_rotation;
    }
    d.topLeftCorner<3, 3>() -= lt.moment_by_rotation;
    d.bottomLeftCorner<3, 3>() -= lt.force_by_rotation;
    d.bottomRightCorner<3, 3>() -= s * lt.force_by_velocity;
    if (rest && inertia && !eta.isZero(0.0)) {
      // d eta has ad_eta zeta besides s zeta: what velocity does to inertia and loads, times it.
      const Matrix6 ad = SmallAdjoint(eta);
      Matrix6 by_twist = ad.transpose() * m.asDiagonal();
      by_twist += CoadjointMatrix(m.cwiseProduct(eta));
      by_twist.bottomRightCorner<3, 3>() += lt.force_by_velocity;
      if (loaded) by_twist += ad.transpose() * payload + CoadjointMatrix(payload * eta);
      d.noalias() -= by_twist * ad;
    }
  };
  for (int i = 0; i <= n; ++i) {  // the root has the inertia of node 0
    add_place(rod.nodes[i], pose[i], twist[i], i, i > 0, &chain.diagonal[i]);
  }
  Vector6 before = kZero;  // acceleration of the element's first node
  if (!rest && plant.exact()) {
    before = AdjointInverseTimes(rod.mount, at.acceleration->head<6>());
  }
  for (int i = 0; i < n; ++i) {
    const RodNode& place = rod.middles[i];
    const RodMiddle& m = work.rod[a][i].middle;
    const MiddleState& middle = work.middle[a][i];
    Matrix6 form = Matrix6::Zero();
    add_place(place, MiddlePose(place, m, pose[i]), middle.twist, -1, true, &form);
    FormFromAhead(place.ahead_m, &form);
    MiddleMotion motion{place.FullInertia(), place.ahead_m,           -middle.wrench,
                        middle.tau_rate,     twist[i + 1] - twist[i], kZero};
    if (!rest) {
      const Vector6 after = at.acceleration->segment<6>(plant.ArmVelocity(a, i + 1));
      motion.residual += motion.inertia.cwiseProduct(MiddleTwist(place, m, before, after));
      motion.acceleration_change = after - before;
      before = after;
    }
    motion.residual = WrenchFromAhead(place.ahead_m, motion.residual);
    const MiddleBlocks b = MiddleTangent(m, form, motion, s, chart);
    chain.diagonal[i] += b.a11;
    chain.diagonal[i + 1] += b.a22;
    if (strain_coordinates_) {
      part.strain.elements[i].a12 = b.a12;
      part.strain.elements[i].a21 = b.a21;
    } else {
      chain.upper[i] += b.a12;
      chain.lower[i] += b.a21;
    }
  }
  if (strain_coordinates_) part.strain.nodes = chain.diagonal;
}

void NewtonMatrix::AssembleShell(const Plant& plant, const PlantState& state,
                                 const PlantInputs& inputs, const PlantWork& work,
                                 const Linearisation& at) {
  const Shell& shell = *plant.shell;
  const double s = at.s;
  const int n = shell.element_count();
  BlockTridiagonal<3>& chain = shell_.chain;
  for (auto& d : chain.diagonal) d.setZero();
  ShellElementTangent t;
  for (int i = 0; i < n; ++i) {
    ShellElementTangents(shell.elements[i], shell.material, work.shell[i], s, &t);
    chain.diagonal[i] += t.a11;
    chain.diagonal[i + 1] += t.a22;
    chain.upper[i] = t.a12;
    chain.lower[i] = t.a21;
  }
  for (int j = 0; j <= n; ++j) chain.diagonal[j].diagonal() += s * s * shell.nodes[j].inertia;
  if (at.rest() && plant.exact() && plant.robot.effects.lateral_added_mass) {
    // The energy 1/2 rho U v^2 of the water around a held mantle in a current
    // (AddCentrifugalForces; its other terms go with the root's turning).
    const double pressure =
        0.5 * plant.water_options.water_density_kg_m3 * state.velocity.segment<2>(3).squaredNorm();
    SubtractVolumeTangent(state.shape, pressure, &chain);
  }

  Border& b = shell_.border;
  b.column.setZero();
  b.row.setZero();
  b.base_column.setZero();
  b.base_row.setZero();
  const ShellMotion motion = MantleMotionOf(plant, state, inputs, work);
  ShellTangent tangent{s,         at.rest(), work.volume_gradient, &chain,
                       &b.column, &b.row,    &b.base_column,       &b.base_row};
  for (const MantleLoad& load : plant.mantle_loads) {
    std::visit([&](const auto& l) { l.AddTangent(motion, &tangent); }, load);
  }
  for (std::size_t k = 0; k < shell.spokes.size(); ++k) {
    const int index = plant.SpokeIndex(static_cast<int>(k));
    const CableInput& in = inputs.cables[index];
    if (!in.reeled || work.cable_tension_n[index] == 0.0) continue;
    const ShellSpokes& spokes = shell.spokes[k];
    for (int j = 0; j <= n; ++j) {
      const double g = spokes.spokes * spokes.strip.area_m2[j] / spokes.strip.total_m2;
      b.column(3 * j, kShellLoadBorders + static_cast<int>(k)) = g;
      b.row(3 * j, kShellLoadBorders + static_cast<int>(k)) =
          -(in.stiffness_n_m + s * in.damping_n_s_m) * g;
    }
  }
  shell_.coupling.setZero();
  if (plant.exact() && plant.root_free()) {
    for (int j = 0; j <= n; ++j) shell_.coupling(3 * j + 1) = s * s * shell.nodes[j].inertia(1);
  }

  for (int j : {0, n}) {  // held coordinates: identity rows and columns
    for (int k = 0; k < 3; ++k) {
      if (shell.nodes[j].held(k) == 0.0) continue;
      chain.diagonal[j].row(k).setZero();
      chain.diagonal[j].col(k).setZero();
      chain.diagonal[j](k, k) = 1.0;
      if (j == 0) {
        chain.upper[0].row(k).setZero();
        chain.lower[0].col(k).setZero();
      } else {
        chain.lower[n - 1].row(k).setZero();
        chain.upper[n - 1].col(k).setZero();
      }
      b.column.row(3 * j + k).setZero();
      b.row.row(3 * j + k).setZero();
      shell_.coupling(3 * j + k) = 0.0;
    }
  }
}

}  // namespace mantle::model
