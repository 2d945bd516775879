#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>
#include <vector>

namespace mantle::model {

/// Inverse of a 3x3 block by cofactors, of a 6x6 block by 3x3 Schur complements; where the leading
/// block is (nearly) singular though the whole is not, by LU with pivoting.
inline Eigen::Matrix3d InvertBlock(const Eigen::Matrix3d& a) { return a.inverse(); }
Eigen::Matrix<double, 6, 6> InvertBlock(const Eigen::Matrix<double, 6, 6>& a);

/// Negative eigenvalues of the symmetric part of a pivot, scaled to a unit diagonal. Within
/// kNeutral of zero counts as zero: what Newton's tolerance leaves of a direction without
/// stiffness.
template <int B>
int NegativeEigenvaluesOf(const Eigen::Matrix<double, B, B>& pivot) {
  constexpr double kNeutral = 1e-9;
  const Eigen::Matrix<double, B, 1> size = pivot.diagonal().cwiseAbs().cwiseMax(
      std::numeric_limits<double>::min() + kNeutral * pivot.cwiseAbs().maxCoeff());
  const Eigen::Matrix<double, B, 1> scale = size.cwiseSqrt().cwiseInverse();
  const Eigen::Matrix<double, B, B> unit =
      scale.asDiagonal() * (0.5 * (pivot + pivot.transpose())) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, B, B>> solver(unit,
                                                                          Eigen::EigenvaluesOnly);
  return static_cast<int>((solver.eigenvalues().array() < -kNeutral).count());
}

/// O(N) direct solver for block-tridiagonal matrices, eliminated from the last block to the first,
/// so that what remains at block 0 is the Schur complement on the end that joins the rest of a
/// robot.
///
///   A_ii' = A_ii - A_i,i+1 W_i+1,   W_i = A_ii'^-1 A_i,i-1
///
/// Blocks are B x B: 6 for the nodes of an arm, 3 for those of the mantle. Vectors are stacked
/// block by block. Fill `diagonal`, `upper` and `lower`, Factor() once, then Eliminate() and
/// Substitute() every right-hand side.
template <int B>
class BlockTridiagonal {
 public:
  using Block = Eigen::Matrix<double, B, B>;
  using Vector = Eigen::Matrix<double, B, 1>;

  explicit BlockTridiagonal(int blocks = 0)
      : diagonal(blocks), upper(blocks), lower(blocks), inverse_(blocks), w_(blocks) {}

  int size() const { return static_cast<int>(diagonal.size()); }
  void SetZero() {
    for (int i = 0; i < size(); ++i) {
      diagonal[i].setZero();
      upper[i].setZero();
      lower[i].setZero();
    }
  }

  /// A_ii, A_i,i+1 in upper[i] and A_i+1,i in lower[i]. Factor() overwrites `diagonal`.
  std::vector<Block> diagonal, upper, lower;

  /// Eliminates blocks size-1 ... first; false if a pivot block is singular or not finite. Blocks
  /// below `first` hold their Schur complements afterwards.
  bool Factor(int first) {
    for (int i = size() - 1; i >= first; --i) {
      inverse_[i] = InvertBlock(diagonal[i]);
      if (!inverse_[i].allFinite()) return false;
      if (i > 0) {
        w_[i].noalias() = inverse_[i] * lower[i - 1];
        diagonal[i - 1].noalias() -= upper[i - 1] * w_[i];
      }
    }
    return true;
  }

  /// First half of a solve: b_i <- A_ii'^-1 b_i' and b_i-1 <- b_i-1 - A_i-1,i b_i, down to `first`.
  template <typename Vec>
  void Eliminate(int first, Vec&& b) const {
    for (int i = size() - 1; i >= first; --i) {
      const Vector y = inverse_[i] * b.template segment<B>(B * i);
      b.template segment<B>(B * i) = y;
      if (i > 0) b.template segment<B>(B * (i - 1)).noalias() -= upper[i - 1] * y;
    }
  }

  /// Second half: x_i = y_i - W_i x_i-1 for i = first ..., with x_first-1 already in place (taken
  /// as zero where first = 0).
  template <typename Vec>
  void Substitute(int first, Vec&& b) const {
    for (int i = first; i < size(); ++i) {
      if (i > 0) {
        b.template segment<B>(B * i).noalias() -= w_[i] * b.template segment<B>(B * (i - 1));
      }
    }
  }

  /// Negative eigenvalues of the symmetric part of the pivots from `first` on, counted after
  /// Factor(): by Sylvester's law of inertia those of a symmetric matrix itself. Pivots are scaled
  /// to a unit diagonal first, so that rad and m compare.
  int NegativePivots(int first) const {
    int negative = 0;
    for (int i = size() - 1; i >= first; --i) negative += NegativeEigenvaluesOf<B>(diagonal[i]);
    return negative;
  }

 private:
  std::vector<Block> inverse_, w_;
};

}  // namespace mantle::model
