#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace mantle::reduced {

/// What Polynomials::Evaluate computes at one point; Polynomials::Size gives it its sizes.
struct PolynomialValues {
  Eigen::VectorXd value;                 ///< per output
  Eigen::MatrixXd gradient;              ///< variables x outputs
  std::vector<Eigen::MatrixXd> hessian;  ///< per output, on demand
};

/// Several polynomials in the mantle's coordinates at once, found from values of the plant's own
/// functions (volume, moments of inertia, ...), which are exact polynomials of known degree in a
/// linear space of shapes. No formula is written a second time, and value, gradient and Hessian are
/// sums over a few dozen monomials (the derivatives' coefficients are made once) instead of a loop
/// over the mesh.
class Polynomials {
 public:
  Polynomials() = default;
  /// Fits `outputs` polynomials of total degree <= `degree` to `function` (which fills a vector of
  /// `outputs` values) on points within |x_i| <= scale_i. Throws std::runtime_error where the
  /// function is not such a polynomial to kFitTolerance relative to its range.
  Polynomials(int degree, const Eigen::VectorXd& scale, int outputs,
              const std::function<void(const Eigen::VectorXd&, Eigen::VectorXd*)>& function);

  int variables() const { return static_cast<int>(inverse_scale_.size()); }
  int outputs() const { return outputs_; }
  /// Allocates; once.
  void Size(PolynomialValues* values) const;
  void Evaluate(const double* x, bool with_hessian, PolynomialValues* values);

 private:
  struct Monomial {
    int parent, variable;  ///< monomial = parent times x_variable; the first one is 1
  };
  /// Sums of the first `rows` monomials: row by row, one column per number, padded.
  struct Table {
    int rows{0}, columns{0};
    std::vector<double> entries;
  };
  Table MakeTable(int rows, int columns) const;
  void MakeDerivatives(int degree, const Eigen::MatrixXd& coefficients);

  int outputs_{0};
  Eigen::VectorXd inverse_scale_;
  std::vector<Monomial> monomials_;
  std::vector<int> count_;  // of monomials up to each degree
  Table value_, gradient_, hessian_;
  std::vector<double> monomial_, sum_;  // at x / scale; sums of a table
};

}  // namespace mantle::reduced
