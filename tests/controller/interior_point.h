#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "controller/program.h"

namespace mantle::tests {

/// A strictly convex quadratic program read through its functions, and its solution by a
/// primal-dual interior point (S. Mehrotra, SIAM J. Optim. 2, 1992) in extended precision: no
/// active set, no sparse matrices and no common line with the solvers under test.
class InteriorPoint {
 public:
  using Real = long double;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

  explicit InteriorPoint(controller::Program* program) {
    const int n = program->variables(), m = program->constraints();
    Eigen::VectorXd low(n + m), high(n + m), zero = Eigen::VectorXd::Zero(std::max(n, m));
    program->Bounds(low.data(), high.data(), low.data() + n, high.data() + n);
    Eigen::VectorXd g(n), offset(m);
    program->Gradient(zero.data(), true, g.data());
    program->Constraints(zero.data(), false, offset.data());
    gradient = g.cast<Real>();
    hessian.setZero(n, n);
    std::vector<double> values(program->HessianPattern().row.size());
    program->Hessian(zero.data(), false, 1, zero.data(), values.data());
    for (std::size_t e = 0; e < values.size(); ++e) {
      const int i = program->HessianPattern().row[e], j = program->HessianPattern().column[e];
      hessian(i, j) += values[e];
      if (i != j) hessian(j, i) += values[e];
    }
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n + m, n);
    a.topRows(n).setIdentity();
    values.resize(program->JacobianPattern().row.size());
    program->Jacobian(zero.data(), false, values.data());
    for (std::size_t e = 0; e < values.size(); ++e) {
      a(n + program->JacobianPattern().row[e], program->JacobianPattern().column[e]) += values[e];
    }
    low.tail(m) -= offset;
    high.tail(m) -= offset;
    std::vector<Real> bound;
    std::vector<Eigen::VectorXd> normal;
    for (int c = 0; c < n + m; ++c) {
      if (std::isfinite(low(c))) {
        normal.emplace_back(a.row(c).transpose());
        bound.push_back(low(c));
      }
      if (std::isfinite(high(c))) {
        normal.emplace_back(-a.row(c).transpose());
        bound.push_back(-high(c));
      }
    }
    normals.resize(static_cast<Eigen::Index>(normal.size()), n);
    for (std::size_t i = 0; i < normal.size(); ++i) {
      normals.row(static_cast<Eigen::Index>(i)) = normal[i].cast<Real>().transpose();
    }
    bounds = Vector::Map(bound.data(), static_cast<Eigen::Index>(bound.size()));
  }

  Real Objective(const Vector& x) const { return x.dot(hessian * x) / 2 + gradient.dot(x); }

  /// The minimum over normals x >= bounds, until the gap is 1e-13 of the objective's size.
  Vector Solve() const {
    const Eigen::Index n = gradient.size(), m = bounds.size();
    const Real unit = hessian.diagonal().maxCoeff();  // the objective's scale is no matter
    const Matrix h = hessian / unit;
    const Vector g = gradient / unit;
    Vector x = Vector::Zero(n), s = Vector::Ones(m), z = Vector::Ones(m);
    for (int i = 0; i < 100; ++i) {
      const Vector dual = h * x + g - normals.transpose() * z, primal = normals * x - s - bounds;
      const Real mu = s.dot(z) / static_cast<Real>(m);
      const Real size = std::abs(x.dot(h * x) / 2 + g.dot(x)) + Real(1e-30L);
      if (mu * static_cast<Real>(m) < Real(1e-13L) * size &&
          dual.cwiseAbs().maxCoeff() < Real(1e-14L) && primal.cwiseAbs().maxCoeff() < 1e-14L) {
        break;
      }
      const Vector ratio = z.cwiseQuotient(s);
      const Eigen::LLT<Matrix> factor(h + normals.transpose() * ratio.asDiagonal() * normals);
      Vector dx, ds, dz;
      const auto step = [&](const Vector& product) {  // s dz + z ds = -product
        const Vector right = -ratio.cwiseProduct(primal) - product.cwiseQuotient(s);
        dx = factor.solve(-dual + normals.transpose() * right);
        ds = normals * dx + primal;
        dz = -(product + z.cwiseProduct(ds)).cwiseQuotient(s);
      };
      const auto length = [](const Vector& at, const Vector& by) {
        Real most = 1;
        for (Eigen::Index j = 0; j < at.size(); ++j) {
          if (by(j) < 0) most = std::min(most, -at(j) / by(j));
        }
        return most;
      };
      step(s.cwiseProduct(z));
      const Real affine =
          (s + length(s, ds) * ds).dot(z + length(z, dz) * dz) / static_cast<Real>(m);
      const Real centre = std::pow(affine / mu, Real(3));
      step(s.cwiseProduct(z) + ds.cwiseProduct(dz) - Vector::Constant(m, centre * mu));
      const Real p = std::min(Real(1), Real(0.995L) * length(s, ds));
      const Real d = std::min(Real(1), Real(0.995L) * length(z, dz));
      const Real both = std::min(p, d);
      x += both * dx;
      s += both * ds;
      z += both * dz;
    }
    return x;
  }

  Matrix hessian, normals;
  Vector gradient, bounds;
};

}  // namespace mantle::tests
