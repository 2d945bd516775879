#pragma once

#include <Eigen/Core>

/// @file
/// Products, solves and eigenvalues of dynamic matrices for what is set up once: Eigen's, each
/// compiled in one place. A file that writes them as expressions compiles every kind anew, which
/// takes ten to forty seconds. Loops do not belong here: these allocate.

namespace mantle::model {

/// a b
Eigen::MatrixXd Product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// a^T b
Eigen::MatrixXd TransposeProduct(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// a^-1 b by partial pivoting; not finite where a is singular.
Eigen::MatrixXd Solve(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// a^-1 b, a symmetric; the lower triangle is read.
Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// The least x among those that minimise |a x - b|, for each column; a of any shape and rank.
Eigen::MatrixXd SolveLeastNorm(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Of a real square matrix: its eigenvalues and, in the columns, eigenvectors of length 1.
struct Eigenpairs {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};
Eigenpairs EigenpairsOf(const Eigen::MatrixXd& a);
/// The values alone.
Eigen::VectorXcd EigenvaluesOf(const Eigen::MatrixXd& a);

}  // namespace mantle::model
