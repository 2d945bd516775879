#pragma once

#include "reduced/arm_composite.h"

/// @file
/// The columns of reduced/arm_dynamics.h and their products with composite matrices. Columns are
/// stored by rows (6 x C), so that the C coordinates of a group are the inner loop of every
/// operation.

namespace mantle::reduced {

/// S, S', S'' of an interval from its kinematics, for dOmega/dq = e and its rates e1, e2 (null
/// where it is constant):
///   S = Ad_h T e,   S' = Ad_h (T_dot e + T e1) + ad_V S,
///   S'' = Ad_h (T_ddot e + 2 T_dot e1 + T e2) + ad_V (2 S' - ad_V S) + ad_A S.
void MakeColumns(int count, const double* e, const double* e1, const double* e2, IntervalState* s);

/// Adds the share of one interval to its group's blocks of M, D and K, whose first entries are
/// `mass`, `damping` and `stiffness` (by columns, `stride` apart), for the matrices of all sections
/// beyond it. `local` is the second derivative of the kinematics times the stress. Takes the
/// interval's columns out of the group's sums.
void AddInterval(int count, const Composite& beyond, bool needs_rotation, const double* e,
                 const Matrix6& local, const IntervalState& s, GroupSums* group, double* mass,
                 double* damping, double* stiffness, int stride);

/// out += scale e^T A e (by columns, `stride` apart).
void AddForm(int count, const double* e, const Matrix6& a, double scale, double* out, int stride);

/// Couples a complete group with one before it; the blocks' first entries are those of the earlier
/// group's rows and the later one's columns (upper), and the reverse (lower).
struct GroupBlocks {
  double *mass, *damping, *stiffness;
};
void CoupleGroups(int earlier_count, const GroupSums& earlier, int count, const GroupSums& group,
                  bool needs_rotation, const GroupBlocks& upper, const GroupBlocks& lower,
                  int stride);

}  // namespace mantle::reduced
