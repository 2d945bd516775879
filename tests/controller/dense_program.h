#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "controller/program.h"

namespace mantle::tests {

/// A small dense program given by its functions.
class DenseProgram : public controller::Program {
 public:
  DenseProgram(Eigen::VectorXd start, Eigen::VectorXd x_low, Eigen::VectorXd x_high,
               Eigen::VectorXd g_low, Eigen::VectorXd g_high)
      : start_(std::move(start)),
        x_low_(std::move(x_low)),
        x_high_(std::move(x_high)),
        g_low_(std::move(g_low)),
        g_high_(std::move(g_high)) {
    for (int i = 0; i < constraints(); ++i) {
      for (int j = 0; j < variables(); ++j) {
        jacobian_pattern_.row.push_back(i);
        jacobian_pattern_.column.push_back(j);
      }
    }
    for (int i = 0; i < variables(); ++i) {
      for (int j = 0; j <= i; ++j) {
        hessian_pattern_.row.push_back(i);
        hessian_pattern_.column.push_back(j);
      }
    }
  }

  std::function<double(const Eigen::VectorXd&)> f;
  std::function<Eigen::VectorXd(const Eigen::VectorXd&)> df, g;
  std::function<Eigen::MatrixXd(const Eigen::VectorXd&)> dg;
  std::function<Eigen::MatrixXd(const Eigen::VectorXd&, double, const Eigen::VectorXd&)> h;
  bool is_quadratic{false};

  int variables() const override { return static_cast<int>(start_.size()); }
  int constraints() const override { return static_cast<int>(g_low_.size()); }
  void Bounds(double* x_low, double* x_high, double* g_low, double* g_high) const override {
    std::copy(x_low_.begin(), x_low_.end(), x_low);
    std::copy(x_high_.begin(), x_high_.end(), x_high);
    std::copy(g_low_.begin(), g_low_.end(), g_low);
    std::copy(g_high_.begin(), g_high_.end(), g_high);
  }
  void Start(double* x) const override { std::copy(start_.begin(), start_.end(), x); }
  const controller::SparsePattern& JacobianPattern() const override { return jacobian_pattern_; }
  const controller::SparsePattern& HessianPattern() const override { return hessian_pattern_; }
  bool quadratic() const override { return is_quadratic; }
  bool Objective(const double* x, bool, double* value) override {
    *value = f(At(x));
    return true;
  }
  bool Gradient(const double* x, bool, double* gradient) override {
    Eigen::VectorXd::Map(gradient, variables()) = df(At(x));
    return true;
  }
  bool Constraints(const double* x, bool, double* values) override {
    Eigen::VectorXd::Map(values, constraints()) = g(At(x));
    return true;
  }
  bool Jacobian(const double* x, bool, double* values) override {
    const Eigen::MatrixXd j = dg(At(x));
    for (std::size_t e = 0; e < jacobian_pattern_.row.size(); ++e) {
      values[e] = j(jacobian_pattern_.row[e], jacobian_pattern_.column[e]);
    }
    return true;
  }
  bool Hessian(const double* x, bool, double factor, const double* lambda,
               double* values) override {
    const Eigen::MatrixXd m = h(At(x), factor, Eigen::VectorXd::Map(lambda, constraints()));
    for (std::size_t e = 0; e < hessian_pattern_.row.size(); ++e) {
      values[e] = m(hessian_pattern_.row[e], hessian_pattern_.column[e]);
    }
    return true;
  }

 private:
  Eigen::VectorXd At(const double* x) const { return Eigen::VectorXd::Map(x, variables()); }

  Eigen::VectorXd start_, x_low_, x_high_, g_low_, g_high_;
  controller::SparsePattern jacobian_pattern_, hessian_pattern_;
};

/// The vector of these values.
inline Eigen::VectorXd Of(std::initializer_list<double> values) {
  return Eigen::VectorXd::Map(std::data(values), static_cast<Eigen::Index>(values.size()));
}

}  // namespace mantle::tests
