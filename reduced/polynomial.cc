#include "reduced/polynomial.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <random>
#include <stdexcept>

namespace mantle::reduced {
namespace {

constexpr double kFitTolerance = 1e-9;  // round-off of a well-conditioned fit, with a wide margin
constexpr int kOversampling = 2;
constexpr unsigned kSeed = 5;

}  // namespace

Polynomials::Polynomials(
    int degree, const Eigen::VectorXd& scale, int outputs,
    const std::function<void(const Eigen::VectorXd&, Eigen::VectorXd*)>& function)
    : scale_(scale) {
  const int k = variables();
  // Monomials by degree; a child never multiplies by a variable before its last one.
  monomials_.push_back({-1, 0});
  int begin = 0, end = 1;
  for (int d = 1; d <= degree; ++d) {
    for (int i = begin; i < end; ++i) {
      for (int j = monomials_[i].variable; j < k; ++j) monomials_.push_back({i, j});
    }
    begin = end;
    end = static_cast<int>(monomials_.size());
  }
  const int count = end;
  value_.setZero(count);
  gradient_.setZero(k, count);
  hessian_.setZero(k * k, count);
  coefficients_.setZero(count, outputs);

  const int samples = kOversampling * count + 4;
  Eigen::MatrixXd a(samples, count), b(samples, outputs);
  Eigen::VectorXd x(k), y(outputs);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int s = 0; s < samples; ++s) {
    for (int j = 0; j < k; ++j) x(j) = uniform(random);
    value_(0) = 1.0;
    for (int i = 1; i < count; ++i) {
      value_(i) = value_(monomials_[i].parent) * x(monomials_[i].variable);
    }
    a.row(s) = value_.transpose();
    function(x.cwiseProduct(scale_), &y);
    b.row(s) = y.transpose();
  }
  coefficients_ = a.householderQr().solve(b);
  const Eigen::MatrixXd miss = a * coefficients_ - b;
  for (int o = 0; o < outputs; ++o) {
    const double worst = miss.col(o).cwiseAbs().maxCoeff();
    const double range = b.col(o).cwiseAbs().maxCoeff();
    if (!(worst <= kFitTolerance * range)) {
      throw std::runtime_error(
          fmt::format("mantle: output {} is not a polynomial of degree {} in the coordinates: "
                      "misfit {:.3g} of {:.3g}",
                      o, degree, worst, range));
    }
  }
}

void Polynomials::Size(PolynomialValues* values) const {
  values->value.setZero(outputs());
  values->gradient.setZero(variables(), outputs());
  values->hessian.assign(outputs(), Eigen::MatrixXd::Zero(variables(), variables()));
}

void Polynomials::Evaluate(const double* x, bool with_hessian, PolynomialValues* values) {
  const int k = variables();
  const int count = static_cast<int>(monomials_.size());
  value_(0) = 1.0;
  for (int i = 1; i < count; ++i) {
    const Monomial& m = monomials_[i];
    const double inverse = 1.0 / scale_(m.variable);
    const double factor = x[m.variable] * inverse;
    value_(i) = value_(m.parent) * factor;
    for (int j = 0; j < k; ++j) gradient_(j, i) = gradient_(j, m.parent) * factor;
    gradient_(m.variable, i) += value_(m.parent) * inverse;
    if (!with_hessian) continue;
    for (int j = 0; j < k * k; ++j) hessian_(j, i) = hessian_(j, m.parent) * factor;
    for (int j = 0; j < k; ++j) {
      hessian_(m.variable * k + j, i) += gradient_(j, m.parent) * inverse;
      hessian_(j * k + m.variable, i) += gradient_(j, m.parent) * inverse;
    }
  }
  values->value.noalias() = coefficients_.transpose().lazyProduct(value_);
  values->gradient.noalias() = gradient_.lazyProduct(coefficients_);
  if (!with_hessian) return;
  for (int o = 0; o < outputs(); ++o) {
    Eigen::Map<Eigen::VectorXd>(values->hessian[o].data(), k * k).noalias() =
        hessian_.lazyProduct(coefficients_.col(o));
  }
}

}  // namespace mantle::reduced
