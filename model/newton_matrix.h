#pragma once

#include <Eigen/LU>
#include <vector>

#include "model/block_tridiagonal.h"
#include "model/plant.h"

/// The iteration matrix of implicit steps and of statics, in body increments zeta (g exp(zeta^), q
/// + zeta), factored and solved in O(N):
///
///   A = s^2 M - K - s D,   K = df/dzeta,  D = df/dv,  s = 1/(gamma h)   (s = 0: statics, A = -K)
///
/// Each arm is a chain of 6x6 blocks eliminated from its tip, which leaves its Schur complement on
/// the root; the mantle is a chain of 3x3 blocks that meets the root in the axial direction;
/// scalars that depend on a whole body (tension of a reeled cable, jet thrust, mantle drag) are
/// extra unknowns of their body. K and D are analytic and complete in statics. In steps a few terms
/// that are not stiff are left out: what couples bodies through the root's motion alone
/// (centrifugal forces, lateral drag), how damping tension, jet and drag change with the shape, and
/// the chart's own terms inside elements. One correction then leaves 1e-3 to 1e-2 of the error on a
/// swimming robot (tests/model/newton_matrix_test.cc measures it).

namespace mantle::model {

class NewtonMatrix {
 public:
  explicit NewtonMatrix(const Plant& plant);

  /// Assembles at the state of the last EvaluateForces (which filled `work`) and factors. `chart`
  /// is the coefficient of ad_eta in d eta = (s + chart ad_eta) zeta: 1/2 for increments in a chart
  /// centred at the step's start. Returns false if a pivot is singular.
  bool Factor(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
              const PlantWork& work, double s, double chart);

  /// x = A^-1 x, laid out as v. Rows of held coordinates and of a root that is not free give zero.
  void Solve(const Plant& plant, VectorX* x);

  /// Sign of the determinant over the free coordinates (statics: +1 where stable).
  int DeterminantSign(const Plant& plant) const;

 private:
  // Extra scalar unknowns u of a body: rows [row . x + u = 0], columns into the body and the base.
  struct Border {
    Eigen::MatrixXd column, row;            // n x p
    Eigen::MatrixXd base_column, base_row;  // b x p: into the base's rows; base_row multiplies x0
    Eigen::MatrixXd solved;                 // Z = A^-1 column with x0 = 0
    Eigen::MatrixXd schur_inverse;          // (E - row^T Z)^-1
    Eigen::MatrixXd t;                      // p x b: base_row^T + row^T Y0
    Eigen::MatrixXd q;                      // b x p: base_column - A_0I Z
    Eigen::MatrixXd schur, scaled;          // p x p and p x b scratch
    Eigen::PartialPivLU<Eigen::MatrixXd> lu;
    VectorX u, reduced;
    int active{0};

    bool FactorSchur();  // schur <- I - row^T solved; schur_inverse, scaled = schur_inverse t
  };
  struct ArmPart {
    BlockTridiagonal<6> chain;
    Border border;
    std::vector<int> cables;   // reeled ones
    Eigen::MatrixXd response;  // 6(N+1) x 6: chain's response to a unit base increment
    VectorX rhs;
    Matrix6 adjoint;  // Ad(mount^-1)
  };
  struct ShellPart {
    BlockTridiagonal<3> chain;
    Border border;
    VectorX coupling, response, rhs;  // mass coupling to the root's axial motion, and its solve
    double coupling_pivot{0};
  };

  void AssembleArm(const Plant& plant, int a, const PlantState& state, const PlantInputs& inputs,
                   const PlantWork& work, double s, double chart);
  bool FactorArm(const Plant& plant, int a);
  void AssembleShell(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                     const PlantWork& work, double s);
  bool FactorShell(const Plant& plant);

  std::vector<ArmPart> arms_;
  ShellPart shell_;
  Matrix6 root_, root_inverse_;
};

}  // namespace mantle::model
