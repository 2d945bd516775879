#include "model/block_tridiagonal.h"

#include <cmath>

namespace mantle::model {
namespace {

// The leading block is trusted while its determinant is not this small beside its size cubed.
constexpr double kSingular = 1e-10;

}  // namespace

Eigen::Matrix<double, 6, 6> InvertBlock(const Eigen::Matrix<double, 6, 6>& a) {
  using Eigen::Matrix3d;
  const Matrix3d p = a.topLeftCorner<3, 3>();
  const double size = p.cwiseAbs().maxCoeff();
  if (!(std::abs(p.determinant()) > kSingular * size * size * size)) return a.inverse();
  const Matrix3d pi = p.inverse();
  const Matrix3d q = a.topRightCorner<3, 3>();
  const Matrix3d r = a.bottomLeftCorner<3, 3>();
  const Matrix3d piq = pi * q;
  const Matrix3d rpi = r * pi;
  Matrix3d schur = a.bottomRightCorner<3, 3>();
  schur.noalias() -= r * piq;
  const Matrix3d si = schur.inverse();
  Eigen::Matrix<double, 6, 6> out;
  const Matrix3d sirpi = si * rpi;
  out.topLeftCorner<3, 3>() = pi;
  out.topLeftCorner<3, 3>().noalias() += piq * sirpi;
  out.topRightCorner<3, 3>().noalias() = -(piq * si);
  out.bottomLeftCorner<3, 3>() = -sirpi;
  out.bottomRightCorner<3, 3>() = si;
  return out;
}

}  // namespace mantle::model
