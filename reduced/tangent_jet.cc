#include "reduced/tangent_jet.h"

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

// c_m(s) by its series; `terms` leaves a remainder below 1e-17 of the first term.
template <int Terms>
double Series(int m, double s) {
  double sum = 1.0;
  for (int k = Terms; k >= 1; --k) {
    sum = 1.0 - s * sum / ((2 * k + m) * (2 * k + m - 1));
  }
  return sum * kInverseFactorial[m];
}

// p I - b W + c w w^T
Matrix3 Combine(double p, double b, double c, const Vector3& w) {
  Matrix3 m = (c * w) * w.transpose();
  m.diagonal().array() += p;
  m(1, 0) -= b * w.z();
  m(0, 1) += b * w.z();
  m(0, 2) -= b * w.y();
  m(2, 0) += b * w.y();
  m(2, 1) -= b * w.x();
  m(1, 2) += b * w.x();
  return m;
}

void SubtractHat(double b, const Vector3& w, Matrix3* m) {
  (*m)(1, 0) -= b * w.z();
  (*m)(0, 1) += b * w.z();
  (*m)(0, 2) -= b * w.y();
  (*m)(2, 0) += b * w.y();
  (*m)(2, 1) -= b * w.x();
  (*m)(1, 2) += b * w.x();
}

// m += c (a b^T + b a^T)
void AddSymmetric(double c, const Vector3& a, const Vector3& b, Matrix3* m) {
  const Vector3 ca = c * a;
  const Matrix3 x = ca * b.transpose();
  *m += x + x.transpose();
}

}  // namespace

Stumpff StumpffFunctions(double s) {
  Stumpff out;
  double* c = out.c;
  if (s < kSeriesLimit) {
    if (s < kSmallLimit) {
      c[9] = Series<5>(9, s);
      c[8] = Series<5>(8, s);
    } else if (s < kMediumLimit) {
      c[9] = Series<8>(9, s);
      c[8] = Series<8>(8, s);
    } else {
      c[9] = Series<16>(9, s);
      c[8] = Series<16>(8, s);
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

  Matrix3& f = jet->value.f;
  f = Combine(k.p[0], k.b[0], k.c[0], w);
  Matrix3& g = jet->value.g;
  g = Combine(along(k.p), along(k.b), along(k.c), w);
  SubtractHat(k.b[0], v, &g);
  AddSymmetric(k.c[0], v, w, &g);

  jet->rate.f = Combine(rate(k.p), rate(k.b), rate(k.c), w);
  SubtractHat(k.b[0], w1, &jet->rate.f);
  AddSymmetric(k.c[0], w1, w, &jet->rate.f);
  Matrix3& g1 = jet->rate.g;
  g1 = Combine(along_rate(k.p), along_rate(k.b), along_rate(k.c), w);
  SubtractHat(along(k.b), w1, &g1);
  SubtractHat(rate(k.b), v, &g1);
  SubtractHat(k.b[0], v1, &g1);
  AddSymmetric(along(k.c), w1, w, &g1);
  AddSymmetric(rate(k.c), v, w, &g1);
  AddSymmetric(k.c[0], v1, w, &g1);
  AddSymmetric(k.c[0], v, w1, &g1);

  // R = cos I + c_1 W + c_2 w w^T
  jet->rotation = Combine(1.0 - s * k.b[0], -k.p[0], k.b[0], w);
  jet->position.noalias() = f.transpose() * v;
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

  Matrix3& f2 = jet->second.f;
  f2 = Combine(second(k.p), second(k.b), second(k.c), w);
  SubtractHat(2.0 * rate(k.b), w1, &f2);
  SubtractHat(k.b[0], w2, &f2);
  AddSymmetric(2.0 * rate(k.c), w1, w, &f2);
  AddSymmetric(k.c[0], w2, w, &f2);
  AddSymmetric(k.c[0], w1, w1, &f2);

  Matrix3& g2 = jet->second.g;
  g2 = Combine(along_second(k.p), along_second(k.b), along_second(k.c), w);
  SubtractHat(2.0 * along_rate(k.b), w1, &g2);
  SubtractHat(along(k.b), w2, &g2);
  SubtractHat(second(k.b), v, &g2);
  SubtractHat(2.0 * rate(k.b), v1, &g2);
  SubtractHat(k.b[0], v2, &g2);
  AddSymmetric(2.0 * along_rate(k.c), w1, w, &g2);
  AddSymmetric(along(k.c), w2, w, &g2);
  AddSymmetric(along(k.c), w1, w1, &g2);
  AddSymmetric(second(k.c), v, w, &g2);
  AddSymmetric(2.0 * rate(k.c), v1, w, &g2);
  AddSymmetric(2.0 * rate(k.c), v, w1, &g2);
  AddSymmetric(k.c[0], v2, w, &g2);
  AddSymmetric(2.0 * k.c[0], v1, w1, &g2);
  AddSymmetric(k.c[0], v, w2, &g2);
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
