#pragma once

#include <vector>

#include "model/newton_matrix.h"
#include "model/plant.h"

namespace mantle::model {

/// Tensions u of reeled cables as unknowns of their own in an implicit stage, so that a reel
/// however stiff is a constraint and not a force that overshoots. With T(Theta) = k (l - reel) + d
/// (l_dot - reel_dot) a stage solves, beside the robot's own equations,
///
///   taut:   u - T = 0        where u + (T - u) / S > 0
///   slack:  u = 0            elsewhere
///
/// by a semi-smooth Newton method: the primal-dual active set of Hintermueller, Ito & Kunisch (SIAM
/// J. Optim. 13, 2002). S = 1 + (k + s d) dl/du, the robot's compliance along the cable times the
/// reel's stiffness, makes the test independent of k; it is known once the cable has been taut, and
/// 1 before.
class ReelTensions {
 public:
  explicit ReelTensions(const Plant& plant);

  /// A new stage under these inputs.
  void Begin(const PlantInputs& inputs);
  /// The inputs with the reeled cables' tensions as they are taken, to evaluate forces under.
  const PlantInputs& Given();
  /// The same with the taut cables reeled, for the matrix, which is to be made now.
  const PlantInputs& ForMatrix();
  /// What the matrix says of the cables that are taut in it.
  void TakeWeights(const Plant& plant, const NewtonMatrix& matrix);

  /// From the lengths and rates in `work`: which cables are taut, and residual() = u - T of those.
  /// Returns whether the set has changed; forces and matrix are then to be made anew.
  bool Switch(const PlantWork& work);
  /// Receives du of NewtonMatrix::Solve.
  VectorX* residual() { return &residual_; }
  bool residual_vanishes() const { return residual_.isZero(0.0); }
  /// u <- u - du. Whether all have converged, what is left of a correction being `left` times it,
  /// and of the poses `left_m`: T at those must not differ from u by more than is negligible.
  bool Correct(double left, double left_m, double s);
  /// Whether an increment of this size [m] may make a slack cable taut; s = 1 / (gamma h).
  bool MaySwitch(const PlantWork& work, double s, double size_m) const;

  /// The step was taken.
  void Accept();
  /// The step failed, or the loads jump: nothing but S and the scale of tensions is kept.
  void Forget();

  /// Every number that a restart needs.
  template <typename Number>
  void Walk(Number number) {
    const auto flag = [&](bool* b) {
      double x = *b ? 1.0 : 0.0;
      number(x);
      *b = x != 0.0;
    };
    for (Reel& reel : reels_) {
      number(reel.tension_n);
      number(reel.weight);
      number(reel.peak_n);
      number(reel.matrix_tension_n);
      flag(&reel.taut);
      flag(&reel.in_matrix);
    }
  }
  /// As Begin and Given, with the tensions that the matrix was made with; ForMatrixAgain after.
  const PlantInputs& GivenOfMatrix(const PlantInputs& inputs);
  const PlantInputs& ForMatrixAgain();

 private:
  struct Reel {
    double tension_n{0};
    double weight{1};            // 1 / S
    double peak_n{0};            // largest tension at the end of a step
    double matrix_tension_n{0};  // when the matrix was made
    double lacking_n{0};         // |u - T| before the last correction
    bool taut{false};
    bool in_matrix{false};  // taut when the matrix was made
  };
  double ReelLaw(const PlantWork& work, std::size_t c) const;

  std::vector<Reel> reels_;
  std::vector<CableInput> law_;
  PlantInputs given_;
  VectorX residual_;
};

}  // namespace mantle::model
