#include "reduced/polynomial.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <random>
#include <stdexcept>

#include "reduced/row.h"

namespace mantle::reduced {
namespace {

constexpr double kFitTolerance = 1e-9;  // round-off of a well-conditioned fit, with a wide margin
constexpr int kOversampling = 2;
constexpr unsigned kSeed = 5;
constexpr int kWidth = 16;  // columns of a table are padded to this

// sum = table^T x
MANTLE_VECTOR_CLONES void Sum(int rows, int columns, const double* table, const double* x,
                              double* sum) {
  for (int at = 0; at < columns; at += kWidth) {
    Row<kWidth> local;
    local.Zero();
    const double* row = table + at;
    for (int i = 0; i < rows; ++i, row += columns) local.Add(x[i], row);
    local.Store(sum + at);
  }
}

}  // namespace

Polynomials::Polynomials(
    int degree, const Eigen::VectorXd& scale, int outputs,
    const std::function<void(const Eigen::VectorXd&, Eigen::VectorXd*)>& function)
    : outputs_(outputs), inverse_scale_(scale.cwiseInverse()) {
  const int k = variables();
  // Monomials by degree; a child never multiplies by a variable before its last one.
  monomials_.push_back({-1, 0});
  int begin = 0, end = 1;
  count_.push_back(end);
  for (int d = 1; d <= degree; ++d) {
    for (int i = begin; i < end; ++i) {
      for (int j = monomials_[i].variable; j < k; ++j) monomials_.push_back({i, j});
    }
    begin = end;
    end = static_cast<int>(monomials_.size());
    count_.push_back(end);
  }
  const int count = end;
  monomial_.assign(count, 1.0);

  const int samples = kOversampling * count + 4;
  Eigen::MatrixXd a(samples, count), b(samples, outputs);
  Eigen::VectorXd x(k), y(outputs);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int s = 0; s < samples; ++s) {
    for (int j = 0; j < k; ++j) x(j) = uniform(random);
    for (int i = 1; i < count; ++i) {
      monomial_[i] = monomial_[monomials_[i].parent] * x(monomials_[i].variable);
    }
    a.row(s) = Eigen::Map<const Eigen::RowVectorXd>(monomial_.data(), count);
    function(x.cwiseProduct(scale), &y);
    b.row(s) = y.transpose();
  }
  const Eigen::MatrixXd coefficients = a.householderQr().solve(b);
  const Eigen::MatrixXd miss = a * coefficients - b;
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
  MakeDerivatives(degree, coefficients);
}

Polynomials::Table Polynomials::MakeTable(int rows, int columns) const {
  const int padded = (columns + kWidth - 1) / kWidth * kWidth;
  return {rows, padded, std::vector<double>(static_cast<std::size_t>(rows) * padded, 0.0)};
}

void Polynomials::MakeDerivatives(int degree, const Eigen::MatrixXd& coefficients) {
  const int k = variables(), count = count_[degree];
  // derivative of monomial i in x_j: factor(i, j) times monomial lower(i, j)
  Eigen::MatrixXi factor = Eigen::MatrixXi::Zero(count, k), lower = factor;
  const auto child = [&](int parent, int variable) {  // variables of a path never decrease
    std::vector<int> path = {variable};
    for (int i = parent; i > 0; i = monomials_[i].parent) path.push_back(monomials_[i].variable);
    std::sort(path.begin(), path.end());
    int at = 0;
    for (int v : path) {
      int i = at + 1;
      while (monomials_[i].parent != at || monomials_[i].variable != v) ++i;
      at = i;
    }
    return at;
  };
  for (int i = 1; i < count; ++i) {
    const auto [parent, variable] = monomials_[i];
    for (int j = 0; j < k; ++j) {
      factor(i, j) = factor(parent, j) + (j == variable ? 1 : 0);
      if (factor(i, j) == 0) continue;
      lower(i, j) = j == variable ? parent : child(lower(parent, j), variable);
    }
  }
  value_ = MakeTable(count, outputs_);
  gradient_ = MakeTable(count_[std::max(degree - 1, 0)], k * outputs_);
  hessian_ = MakeTable(count_[std::max(degree - 2, 0)], k * k * outputs_);
  for (int i = 0; i < count; ++i) {
    for (int o = 0; o < outputs_; ++o) {
      value_.entries[i * value_.columns + o] = coefficients(i, o);
      for (int j = 0; j < k; ++j) {
        if (factor(i, j) == 0) continue;
        const int once = lower(i, j);
        const double first = factor(i, j) * inverse_scale_(j) * coefficients(i, o);
        gradient_.entries[once * gradient_.columns + o * k + j] += first;
        for (int l = 0; l < k; ++l) {
          if (factor(once, l) == 0) continue;
          hessian_.entries[lower(once, l) * hessian_.columns + (o * k + j) * k + l] +=
              factor(once, l) * inverse_scale_(l) * first;
        }
      }
    }
  }
  sum_.assign(std::max({value_.columns, gradient_.columns, hessian_.columns}), 0.0);
}

void Polynomials::Size(PolynomialValues* values) const {
  values->value.setZero(outputs());
  values->gradient.setZero(variables(), outputs());
  values->hessian.assign(outputs(), Eigen::MatrixXd::Zero(variables(), variables()));
}

void Polynomials::Evaluate(const double* x, bool with_hessian, PolynomialValues* values) {
  const int k = variables();
  for (std::size_t i = 1; i < monomials_.size(); ++i) {
    const Monomial& m = monomials_[i];
    monomial_[i] = monomial_[m.parent] * (x[m.variable] * inverse_scale_(m.variable));
  }
  const auto sum = [&](const Table& t) {
    Sum(t.rows, t.columns, t.entries.data(), monomial_.data(), sum_.data());
  };
  sum(value_);
  std::copy_n(sum_.data(), outputs_, values->value.data());
  sum(gradient_);
  std::copy_n(sum_.data(), k * outputs_, values->gradient.data());
  if (!with_hessian) return;
  sum(hessian_);
  for (int o = 0; o < outputs_; ++o) {
    std::copy_n(sum_.data() + o * k * k, k * k, values->hessian[o].data());
  }
}

}  // namespace mantle::reduced
