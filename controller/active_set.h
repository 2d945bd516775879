#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace mantle::controller {

/// A strictly convex quadratic program in n variables,
///
///   min x^T H x / 2 + g^T x    s.t.    low_c <= a_c^T x <= high_c,    c = 0 .. n + m - 1,
///
/// whose first n constraints are the bounds of the variables (a_c = e_c) and whose others are m
/// rows, each a list of entries. Infinite bounds are none.
struct QuadraticProgram {
  Eigen::MatrixXd hessian;  ///< n x n, lower triangle
  Eigen::VectorXd gradient, low, high;
  std::vector<int> first;   ///< entries of row r (of m): first[r] .. first[r + 1] - 1
  std::vector<int> column;  ///< of an entry
  std::vector<double> by;   ///< its value

  /// n, and n + m.
  int variables() const { return static_cast<int>(gradient.size()); }
  int constraints() const { return static_cast<int>(low.size()); }
  /// a_c^T x.
  double Value(int c, const Eigen::VectorXd& x) const;
};

/// The solution of a QuadraticProgram by a dual active-set method (D. Goldfarb, A. Idnani, A
/// numerically stable dual method for solving strictly convex quadratic programs, Math. Program.
/// 27, 1983): every point on the way is the minimum over the constraints held so far, and the most
/// violated one comes next. It ends after finitely many changes at the exact active set, whatever
/// the scale of the objective.
///
/// In y = L^T x, H = L L^T, the held constraints' normals are the columns of L^-1 N = Q R, Q with
/// orthonormal columns; a constraint comes by a Gram-Schmidt step and goes by rotations, O(n k)
/// with k held. At the end x and its multipliers are refined against H itself, so that the
/// residuals are those of round-off.
class ActiveSet {
 public:
  /// How it ended; kBudget: after `most_points`, kNotConvex: H has no Cholesky factor.
  enum class End { kSolved, kBudget, kDeadline, kInfeasible, kNotConvex };

  /// A constraint held: which, and at which of its bounds.
  struct Held {
    int constraint{0};
    bool at_high{false};
  };

  /// Solves. `guess` is held first, as far as multipliers allow: the better it is, the fewer
  /// changes. `most_points` bounds how many points are looked at, the minimum without constraints
  /// being the first; `deadline_ns` (steady_clock, 0: none) is looked at before each. Allocates
  /// where sizes grow alone.
  End Solve(const QuadraticProgram& program, const std::vector<Held>& guess, int most_points,
            std::int64_t deadline_ns);

  /// Where it ended: the minimum over what is held.
  const Eigen::VectorXd& x() const { return x_; }
  /// The active set.
  const std::vector<Held>& held() const { return held_; }
  /// Of held()[i], at least 0.
  double multiplier(int i) const { return multipliers_(i); }
  /// Points looked at.
  int points() const { return points_; }

 private:
  void Resize(const QuadraticProgram& program);
  double Bound(const Held& h) const;
  /// L^-1 of the signed normal, which points into the feasible side.
  void Normal(const Held& h, Eigen::VectorXd* v) const;
  /// v - Q Q^T v into rest_, Q^T v into along_; the rest's norm, 0 where v depends on what is held.
  double Split(const Eigen::VectorXd& v);
  void Hold(const Held& h, double multiplier, double norm);
  void Drop(int i);
  void Point();
  /// R^-1 b of the first k entries, in place; R^-T b.
  void BackSubstitute(Eigen::VectorXd* b) const;
  void ForwardSubstitute(Eigen::VectorXd* b) const;
  void Begin(const std::vector<Held>& guess);
  bool MostViolated(Held* h, double* violation) const;
  void Refine();

  const QuadraticProgram* program_{nullptr};
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd q_, r_;
  Eigen::VectorXd x_, y_, normal_, rest_, along_, again_, direction_, multipliers_, scale_;
  Eigen::VectorXd residual_, gap_, change_;
  std::vector<Held> held_;
  std::vector<char> is_held_;
  double feasible_{0};
  int points_{0};
};

}  // namespace mantle::controller
