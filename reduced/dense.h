#pragma once

#include <Eigen/Core>
#include <vector>

/// @file
/// Dense kernels of the step's Newton matrix and of its derivatives, for a few dozen unknowns,
/// where the packing of a general library's blocked algorithms costs more than the arithmetic.
///
/// Right-hand sides are panels: row by row, with a multiple of kPanelWidth columns, so that one row
/// times a number is the inner loop.

namespace mantle::reduced {

inline constexpr int kPanelWidth = 16;
using Panel = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Columns of a panel that holds `columns`.
constexpr int PanelColumns(int columns) {
  return (columns + kPanelWidth - 1) / kPanelWidth * kPanelWidth;
}

/// P A = L U with partial pivoting (Golub & Van Loan, Matrix Computations, 2013, alg. 3.4.1). A
/// singular matrix gives results that are not finite. No allocation but in the constructor.
class DenseLu {
 public:
  explicit DenseLu(int n);

  void Factor(const Eigen::MatrixXd& a);
  /// x = A^-1 x.
  void Solve(Eigen::VectorXd* x);
  void Solve(Panel* x) const;

 private:
  int n_, stride_;
  std::vector<double> lower_, upper_;     // by columns, padded, zero outside their triangles
  std::vector<double> inverse_, vector_;  // 1 / diagonal of U; scratch
  std::vector<int> pivot_;
};

/// c += a b; b and c have whole panel widths of columns.
void AddProduct(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Panel>& b,
                Eigen::Ref<Panel> c);

}  // namespace mantle::reduced
