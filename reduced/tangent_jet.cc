#include "reduced/tangent_jet.h"

#include <array>
#include <cmath>

namespace mantle::reduced {
namespace {

// Beyond this angle squared ((2 pi)^2) the trigonometric functions start the recurrence upwards,
// where it divides by s each time and is stable; below it the series start it downwards.
constexpr double kSeriesLimit = 40.0;
constexpr double kMediumLimit = 4.0;
constexpr double kSmallLimit = 0.1;
constexpr double kInverseFactorial[10] = {1.0,           1.0,           1.0 / 2.0,   1.0 / 6.0,
                                          1.0 / 24.0,    1.0 / 120.0,   1.0 / 720.0, 1.0 / 5040.0,
                                          1.0 / 40320.0, 1.0 / 362880.0};

// c_M(s) by its series; `Terms` leaves a remainder below 1e-17 of the first term.
template <int M, int Terms>
double Series(double s) {
  static constexpr std::array<double, Terms + 1> kInverse = [] {
    std::array<double, Terms + 1> a{};
    for (int k = 1; k <= Terms; ++k) a[k] = 1.0 / ((2 * k + M) * (2 * k + M - 1));
    return a;
  }();
  double sum = 1.0;
  for (int k = Terms; k >= 1; --k) sum = 1.0 - s * sum * kInverse[k];
  return sum * kInverseFactorial[M];
}

// alpha I - beta~ + sum (a w^T + w a^T)
struct Operator {
  double xx, yy, zz, xy, xz, yz;
  Vector3 beta;

  Operator(double alpha, const Vector3& b)
      : xx(alpha), yy(alpha), zz(alpha), xy(0), xz(0), yz(0), beta(b) {}

  Operator& Add(const Vector3& a, const Vector3& w) {
    xx += 2.0 * a.x() * w.x();
    yy += 2.0 * a.y() * w.y();
    zz += 2.0 * a.z() * w.z();
    xy += a.x() * w.y() + a.y() * w.x();
    xz += a.x() * w.z() + a.z() * w.x();
    yz += a.y() * w.z() + a.z() * w.y();
    return *this;
  }
  void Write(Matrix3* m) const {
    (*m)(0, 0) = xx;
    (*m)(1, 1) = yy;
    (*m)(2, 2) = zz;
    (*m)(1, 0) = xy - beta.z();
    (*m)(0, 1) = xy + beta.z();
    (*m)(2, 0) = xz + beta.y();
    (*m)(0, 2) = xz - beta.y();
    (*m)(2, 1) = yz - beta.x();
    (*m)(1, 2) = yz + beta.x();
  }
};

void SubtractHat(double b, const Vector3& w, Matrix3* m) {
  (*m)(1, 0) -= b * w.z();
  (*m)(0, 1) += b * w.z();
  (*m)(0, 2) -= b * w.y();
  (*m)(2, 0) += b * w.y();
  (*m)(2, 1) -= b * w.x();
  (*m)(1, 2) += b * w.x();
}

}  // namespace

Stumpff StumpffFunctions(double s) {
  Stumpff out;
  double* c = out.c;
  if (s < kSeriesLimit) {
    if (s < kSmallLimit) {
      c[9] = Series<9, 5>(s);
      c[8] = Series<8, 5>(s);
    } else if (s < kMediumLimit) {
      c[9] = Series<9, 8>(s);
      c[8] = Series<8, 8>(s);
    } else {
      c[9] = Series<9, 16>(s);
      c[8] = Series<8, 16>(s);
    }
    for (int m = 7; m >= 0; --m) c[m] = kInverseFactorial[m] - s * c[m + 2];
    return out;
  }
  const double t = std::sqrt(s);
  c[0] = std::cos(t);
  c[1] = std::sin(t) / t;
  for (int m = 0; m < 8; ++m) c[m + 2] = (kInverseFactorial[m] - c[m]) / s;
  return out;
}

TangentCoefficients CoefficientsOf(const Stumpff& stumpff) {
  const double* c = stumpff.c;
  return {{c[1], 0.5 * (c[3] - c[2]), 0.25 * (3 * c[5] - 3 * c[4] + c[3]),
           0.125 * (15 * c[7] - 15 * c[6] + 6 * c[5] - c[4])},
          {c[2], 0.5 * (2 * c[4] - c[3]), 0.25 * (8 * c[6] - 5 * c[5] + c[4]),
           0.125 * (48 * c[8] - 33 * c[7] + 9 * c[6] - c[5])},
          {c[3], 0.5 * (3 * c[5] - c[4]), 0.25 * (15 * c[7] - 7 * c[6] + c[5]),
           0.125 * (105 * c[9] - 57 * c[8] + 12 * c[7] - c[6])}};
}

TangentCoefficients EvaluateTangentJet(const Vector6& omega, const Vector6& omega_dot,
                                       TangentJet* jet) {
  const Vector3 w = omega.head<3>(), v = omega.tail<3>();
  const Vector3 w1 = omega_dot.head<3>(), v1 = omega_dot.tail<3>();
  const double s = w.squaredNorm();
  const TangentCoefficients k = CoefficientsOf(StumpffFunctions(s));
  const double s1 = 2.0 * w.dot(w1);
  const double n = 2.0 * w.dot(v);
  const double n1 = 2.0 * (w1.dot(v) + w.dot(v1));
  const auto rate = [&](const double* f) { return f[1] * s1; };
  const auto along = [&](const double* f) { return f[1] * n; };
  const auto along_rate = [&](const double* f) { return f[2] * s1 * n + f[1] * n1; };

  Operator(k.p[0], k.b[0] * w).Add(0.5 * k.c[0] * w, w).Write(&jet->value.f);
  Operator(along(k.p), along(k.b) * w + k.b[0] * v)
      .Add(0.5 * along(k.c) * w + k.c[0] * v, w)
      .Write(&jet->value.g);
  Operator(rate(k.p), rate(k.b) * w + k.b[0] * w1)
      .Add(0.5 * rate(k.c) * w + k.c[0] * w1, w)
      .Write(&jet->rate.f);
  Operator(along_rate(k.p), along_rate(k.b) * w + along(k.b) * w1 + rate(k.b) * v + k.b[0] * v1)
      .Add(0.5 * along_rate(k.c) * w + along(k.c) * w1 + rate(k.c) * v + k.c[0] * v1, w)
      .Add(k.c[0] * v, w1)
      .Write(&jet->rate.g);

  // R = cos I + c_1 W + c_2 w w^T
  Operator(1.0 - s * k.b[0], -k.p[0] * w).Add(0.5 * k.b[0] * w, w).Write(&jet->rotation);
  jet->position.noalias() = jet->value.f.transpose() * v;
  return k;
}

void EvaluateSecondTangent(const TangentCoefficients& k, const Vector6& omega,
                           const Vector6& omega_dot, const Vector6& omega_ddot, TangentJet* jet) {
  const Vector3 w = omega.head<3>(), v = omega.tail<3>();
  const Vector3 w1 = omega_dot.head<3>(), v1 = omega_dot.tail<3>();
  const Vector3 w2 = omega_ddot.head<3>(), v2 = omega_ddot.tail<3>();
  const double s1 = 2.0 * w.dot(w1);
  const double s2 = 2.0 * (w1.squaredNorm() + w.dot(w2));
  const double n = 2.0 * w.dot(v);
  const double n1 = 2.0 * (w1.dot(v) + w.dot(v1));
  const double n2 = 2.0 * (w2.dot(v) + 2.0 * w1.dot(v1) + w.dot(v2));
  const auto rate = [&](const double* f) { return f[1] * s1; };
  const auto second = [&](const double* f) { return f[2] * s1 * s1 + f[1] * s2; };
  const auto along = [&](const double* f) { return f[1] * n; };
  const auto along_rate = [&](const double* f) { return f[2] * s1 * n + f[1] * n1; };
  const auto along_second = [&](const double* f) {
    return f[3] * s1 * s1 * n + f[2] * (s2 * n + 2.0 * s1 * n1) + f[1] * n2;
  };
  const double c = k.c[0], c_rate = 2.0 * rate(k.c), c_along = along(k.c);

  Operator(second(k.p), second(k.b) * w + 2.0 * rate(k.b) * w1 + k.b[0] * w2)
      .Add(0.5 * second(k.c) * w + c_rate * w1 + c * w2, w)
      .Add(c * w1, w1)
      .Write(&jet->second.f);
  Operator(along_second(k.p), along_second(k.b) * w + 2.0 * along_rate(k.b) * w1 + along(k.b) * w2 +
                                  second(k.b) * v + 2.0 * rate(k.b) * v1 + k.b[0] * v2)
      .Add(0.5 * along_second(k.c) * w + 2.0 * along_rate(k.c) * w1 + c_along * w2 +
               second(k.c) * v + c_rate * v1 + c * v2,
           w)
      .Add(c_along * w1 + c_rate * v + 2.0 * c * v1, w1)
      .Add(c * v, w2)
      .Write(&jet->second.g);
}

Matrix6 TangentTransposeDerivative(const TangentCoefficients& k, const Vector6& omega,
                                   const Vector6& sigma) {
  const Vector3 w = omega.head<3>(), v = omega.tail<3>();
  const double n = 2.0 * w.dot(v);
  // F^T x = p x + b w x x + c w (w . x)
  const auto first = [&](const Vector3& x) {
    const double wx = w.dot(x);
    const Vector3 left = 2.0 * (k.p[1] * x + k.b[1] * w.cross(x) + k.c[1] * wx * w);
    Matrix3 m = left * w.transpose();
    m.noalias() += (k.c[0] * w) * x.transpose();
    SubtractHat(k.b[0], x, &m);
    m.diagonal().array() += k.c[0] * wx;
    return m;
  };
  const auto along = [&](const Vector3& x) {  // derivative of first() along v
    const double wx = w.dot(x), vx = v.dot(x);
    const Vector3 cross = w.cross(x);
    const Vector3 by_w = 2.0 * (k.p[2] * n * x + k.b[1] * v.cross(x) + k.b[2] * n * cross +
                                k.c[1] * (wx * v + vx * w) + k.c[2] * n * wx * w);
    const Vector3 by_v = 2.0 * (k.p[1] * x + k.b[1] * cross + k.c[1] * wx * w);
    Matrix3 m = by_w * w.transpose();
    m.noalias() += by_v * v.transpose();
    m.noalias() += (k.c[1] * n * w + k.c[0] * v) * x.transpose();
    SubtractHat(k.b[1] * n, x, &m);
    m.diagonal().array() += k.c[1] * n * wx + k.c[0] * vx;
    return m;
  };
  const Matrix3 lower = first(sigma.tail<3>());
  Matrix6 out;
  out.topLeftCorner<3, 3>() = first(sigma.head<3>()) + along(sigma.tail<3>());
  out.topRightCorner<3, 3>() = lower;
  out.bottomLeftCorner<3, 3>() = lower;
  out.bottomRightCorner<3, 3>().setZero();
  return out;
}

}  // namespace mantle::reduced
