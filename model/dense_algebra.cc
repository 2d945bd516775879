#include "model/dense_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace mantle::model {

using Eigen::MatrixXd;

MatrixXd Product(const MatrixXd& a, const MatrixXd& b) { return a * b; }

MatrixXd TransposeProduct(const MatrixXd& a, const MatrixXd& b) { return a.transpose() * b; }

MatrixXd Solve(const MatrixXd& a, const MatrixXd& b) { return a.partialPivLu().solve(b); }

MatrixXd SolveSymmetric(const MatrixXd& a, const MatrixXd& b) { return a.ldlt().solve(b); }

MatrixXd SolveLeastNorm(const MatrixXd& a, const MatrixXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

Eigenpairs EigenpairsOf(const MatrixXd& a) {
  const Eigen::EigenSolver<MatrixXd> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXcd EigenvaluesOf(const MatrixXd& a) {
  return Eigen::EigenSolver<MatrixXd>(a, false).eigenvalues();
}

}  // namespace mantle::model
