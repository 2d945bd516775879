#pragma once

#include <Eigen/LU>
#include <vector>

#include "model/block_tridiagonal.h"
#include "model/plant.h"
#include "model/strain_chain.h"

namespace mantle::model {

/// The iteration matrix of implicit steps and of statics, in body increments zeta
/// (g exp(zeta^), q + zeta), factored and solved in O(N):
///
///   A = s^2 M - K - s D,   K = df/dzeta,  D = df/dv,  s = 1/(gamma h)   (s = 0: statics, A = -K)
///
/// Each arm is a chain of 6x6 blocks eliminated from its tip, which leaves its Schur complement on
/// the root; the mantle is a chain of 3x3 blocks that meets the root in the axial direction;
/// scalars that depend on a whole body (tension of a reeled cable, jet thrust, mantle drag) are
/// extra unknowns of their body. K and D are analytic and complete about rest with a held root. In
/// steps a few terms that are not stiff are left out: squares of rates beside s^2 (of the mass
/// inside an arm's elements, and of the chart), what couples bodies through the root's motion alone
/// (centrifugal forces, lateral drag), and how damping tension, jet and drag change with the shape.
/// One correction then leaves 1e-3 to 1e-2 of the error on a swimming robot
/// (tests/model/newton_matrix_test.cc measures it).
class NewtonMatrix {
 public:
  explicit NewtonMatrix(const Plant& plant);

  /// Assembles at the state of the last EvaluateForces (which filled `work`) and the acceleration
  /// v_dot there, and factors. `chart` is the coefficient of ad_eta in d eta = (s + chart ad_eta)
  /// zeta, d v_dot = s d eta: 1/2 for increments in a chart centred at the step's start. Returns
  /// false if a pivot is singular.
  bool Factor(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
              const PlantWork& work, const VectorX& acceleration, double s, double chart);

  /// The complete matrix about a state that rests in the earth: motions zeta exp(s t) about it have
  /// d eta = (s + ad_eta) zeta, where eta is what the frame that drifts with a current sees of a
  /// body at rest (zero without one). s = 0 is the tangent of statics; s > 0 that of the linearised
  /// motion (model/motion_modes.h). A clamped or prescribed root is held, and arms are then solved
  /// for in their strains (model/strain_chain.h). Returns false if a pivot is singular.
  bool FactorAtRest(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                    const PlantWork& work, double s);

  /// x = A^-1 x, laid out as v. Rows of held coordinates and of a root that is not free give zero.
  void Solve(const Plant& plant, VectorX* x) { Solve(plant, x, nullptr); }
  /// The same where the tensions of reeled cables are unknowns of their own (after Factor):
  ///   A x - (df/du) du = r,   du - (k + s d) (dl/dzeta) x = rho
  /// with rho in `tensions` (laid out as the inputs' cables), which receives du.
  void Solve(const Plant& plant, VectorX* x, VectorX* tensions);
  /// After Factor, of a taut reeled cable (index as in the inputs): what is left of a tension's
  /// residual once the robot has yielded to it, 1 / (1 + (k + s d) dl/du).
  double TensionShare(const Plant& plant, int cable) const;

  /// Of the last Solve() after FactorAtRest with a held root: the increments of the arms' elements,
  /// d <- d + delta, 6 each, arm after arm. They are accurate where differences of nodes are not.
  const VectorX& strain_increments() const { return strains_; }

  /// Negative eigenvalues of the symmetric part of A over the free coordinates of a root that is
  /// not free: the inertia of the block factorisation (Sylvester). At an equilibrium under
  /// conservative loads A is symmetric and, after FactorAtRest with s = 0, this is the number of
  /// directions in which the potential energy falls. Eigenvalues within round-off of zero count as
  /// not negative.
  int NegativeEigenvalues() const;

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
  /// What is linearised.
  struct Linearisation {
    double s, chart;
    const VectorX* acceleration;  // of a stage of a step; null about a state of rest
    bool rest() const { return acceleration == nullptr; }
  };

  struct ArmPart {
    BlockTridiagonal<6> chain;
    Border border;
    std::vector<int> cables;   // reeled ones
    Eigen::MatrixXd response;  // 6(N+1) x 6: chain's response to a unit base increment
    VectorX rhs;
    Matrix6 adjoint;  // Ad(mount^-1)
    StrainChain strain;
    Eigen::MatrixXd solved_strains;  // of the border's columns
    int first_strain{0};
  };
  struct ShellPart {
    BlockTridiagonal<3> chain;
    Border border;
    VectorX coupling, response, rhs;  // mass coupling to the root's axial motion, and its solve
    double coupling_pivot{0};
  };

  void AssembleArm(const Plant& plant, int a, const PlantState& state, const PlantInputs& inputs,
                   const PlantWork& work, const Linearisation& at);
  bool FactorArm(const Plant& plant, int a);
  void AssembleShell(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                     const PlantWork& work, const Linearisation& at);
  bool FactorShell(const Plant& plant);
  bool FactorAbout(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                   const PlantWork& work, const Linearisation& at);

  bool FactorStrains(ArmPart* part);
  void SolveStrains(const Plant& plant, int a, VectorX* x);

  bool strain_coordinates_{false};
  VectorX strains_;
  std::vector<ArmPart> arms_;
  ShellPart shell_;
  Matrix6 root_, root_inverse_;
};

}  // namespace mantle::model
