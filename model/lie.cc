#include "model/lie.h"

#include <cmath>

namespace mantle::model {
namespace {

// Below kSeriesLimit in s = |omega|^2 the Taylor series are used, with so many terms that the first
// one left out is under 1e-17 relative; below the smaller limits fewer terms do.
constexpr double kSeriesLimit = 2.5;
constexpr double kSmallLimit = 0.05;
constexpr double kTinyLimit = 1e-3;

// |B_2k| / (2k)! for k = 1..18: Taylor coefficients of c(s) (Abramowitz & Stegun 4.3.70).
constexpr double kBernoulli[] = {1.0 / 12.0,
                                 1.0 / 720.0,
                                 1.0 / 30240.0,
                                 1.0 / 1209600.0,
                                 1.0 / 47900160.0,
                                 691.0 / 1307674368e3,
                                 1.0 / 74724249600.0,
                                 3.3896802963225829e-13,
                                 8.5860620562778446e-15,
                                 2.1748686985580619e-16,
                                 5.5090028283602295e-18,
                                 1.3954464685812523e-19,
                                 3.5347070396294675e-21,
                                 8.9535174270375469e-23,
                                 2.2679524523376831e-24,
                                 5.7447906688722024e-26,
                                 1.4551724756148649e-27,
                                 3.6859949406653102e-29};
constexpr int kBernoulliTerms = 18;

// Taylor coefficients in s: cos t, sin(t)/t, (1-cos t)/t^2, (t-sin t)/t^3 (k-th: (-1)^k / (2k+i)!,
// i = 0 ... 3), and the s-derivatives of the last two.
constexpr double kCosine[] = {1.0,
                              -0.5,
                              0.041666666666666664,
                              -0.001388888888888889,
                              2.48015873015873e-05,
                              -2.755731922398589e-07,
                              2.08767569878681e-09,
                              -1.1470745597729725e-11,
                              4.779477332387385e-14,
                              -1.5619206968586225e-16,
                              4.110317623312165e-19,
                              -8.896791392450574e-22,
                              1.6117375710961184e-24,
                              -2.4795962632247976e-27};
constexpr double kA[] = {1.0,
                         -0.16666666666666666,
                         0.008333333333333333,
                         -0.0001984126984126984,
                         2.7557319223985893e-06,
                         -2.505210838544172e-08,
                         1.6059043836821613e-10,
                         -7.647163731819816e-13,
                         2.8114572543455206e-15,
                         -8.22063524662433e-18,
                         1.9572941063391263e-20,
                         -3.868170170630684e-23,
                         6.446950284384474e-26,
                         -9.183689863795546e-29};
constexpr double kB[] = {0.5,
                         -0.041666666666666664,
                         0.001388888888888889,
                         -2.48015873015873e-05,
                         2.755731922398589e-07,
                         -2.08767569878681e-09,
                         1.1470745597729725e-11,
                         -4.779477332387385e-14,
                         1.5619206968586225e-16,
                         -4.110317623312165e-19,
                         8.896791392450574e-22,
                         -1.6117375710961184e-24,
                         2.4795962632247976e-27,
                         -3.279889237069838e-30};
constexpr double kC[] = {0.16666666666666666,     -0.008333333333333333,   0.0001984126984126984,
                         -2.7557319223985893e-06, 2.505210838544172e-08,   -1.6059043836821613e-10,
                         7.647163731819816e-13,   -2.8114572543455206e-15, 8.22063524662433e-18,
                         -1.9572941063391263e-20, 3.868170170630684e-23,   -6.446950284384474e-26,
                         9.183689863795546e-29,   -1.1309962886447716e-31};
constexpr double kB1[] = {-0.041666666666666664,   0.002777777777777778,   -7.440476190476191e-05,
                          1.1022927689594355e-06,  -1.043837849393405e-08, 6.882447358637835e-11,
                          -3.3456341326711696e-13, 1.249536557486898e-15,  -3.6992858609809485e-18,
                          8.896791392450573e-21,   -1.77291132820573e-23,  2.975515515869757e-26,
                          -4.263856008190789e-29,  5.277982680342268e-32};
constexpr double kC1[] = {-0.008333333333333333,   0.0003968253968253968,  -8.267195767195768e-06,
                          1.0020843354176688e-07,  -8.029521918410807e-10, 4.58829823909189e-12,
                          -1.9680200780418645e-14, 6.576508197299464e-17,  -1.7615646957052136e-19,
                          3.868170170630684e-22,   -7.091645312822921e-25, 1.1020427836554655e-27,
                          -1.4702951752382032e-30, 1.7025750581749252e-33};

// atan(x)/x in x^2; below kAtanLimit the first term left out is under 2e-17.
constexpr double kAtan[] = {1.0,       -1.0 / 3, 1.0 / 5,   -1.0 / 7, 1.0 / 9,
                            -1.0 / 11, 1.0 / 13, -1.0 / 15, 1.0 / 17};
constexpr double kAtanLimit = 0.018;

template <int Terms>
double Horner(const double* c, double s) {
  double sum = c[Terms - 1];
  for (int k = Terms - 2; k >= 0; --k) sum = sum * s + c[k];
  return sum;
}

template <int Terms>
ExpCoefficients ExpTaylor(double s) {
  return {Horner<Terms>(kA, s), Horner<Terms>(kB, s), Horner<Terms>(kC, s), Horner<Terms>(kB1, s),
          Horner<Terms>(kC1, s)};
}

template <int Terms>
LogCoefficients LogTaylor(double s) {
  LogCoefficients k{kBernoulli[Terms - 1], 0.0, 0.0};
  for (int i = Terms - 2; i >= 0; --i) {  // Horner, with both derivatives
    k.c2 = k.c2 * s + 2.0 * k.c1;
    k.c1 = k.c1 * s + k.c;
    k.c = k.c * s + kBernoulli[i];
  }
  return k;
}

}  // namespace

Pose operator*(const Pose& a, const Pose& b) {
  return {a.rotation * b.rotation, a.position + a.rotation * b.position};
}

Pose Inverse(const Pose& g) {
  const Eigen::Quaterniond r = g.rotation.conjugate();
  return {r, -(r * g.position)};
}

Vector3 Vee(const Matrix3& m) {
  return 0.5 * Vector3(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
}

ExpCoefficients ExpSeries(double s) {
  if (s < kTinyLimit) return ExpTaylor<5>(s);
  if (s < kSmallLimit) return ExpTaylor<7>(s);
  if (s < kSeriesLimit) return ExpTaylor<14>(s);
  ExpCoefficients k;
  const double t = std::sqrt(s);
  const double half = std::sin(0.5 * t);
  k.a = std::sin(t) / t;
  k.b = 2.0 * half * half / s;
  k.c = (t - std::sin(t)) / (s * t);
  k.b1 = (k.a - 2.0 * k.b) / (2.0 * s);
  k.c1 = (k.b - 3.0 * k.c) / (2.0 * s);
  return k;
}

LogCoefficients LogSeries(double s) {
  if (s < kTinyLimit) return LogTaylor<5>(s);
  if (s < kSmallLimit) return LogTaylor<8>(s);
  if (s < kSeriesLimit) return LogTaylor<18>(s);
  LogCoefficients k;
  const double t = std::sqrt(s);
  const double sine = std::sin(0.5 * t);
  const double cot = std::cos(0.5 * t) / sine;
  const double csc2 = 1.0 / (sine * sine);
  const double g1 = cot / (4.0 * t) - csc2 / 8.0;  // derivatives of (t/2) cot(t/2)
  const double g2 = -csc2 / (16.0 * s) - cot / (8.0 * s * t) + csc2 * cot / (16.0 * t);
  k.c = (1.0 - 0.5 * t * cot) / s;
  k.c1 = -(g1 + k.c) / s;
  k.c2 = -(g2 + 2.0 * k.c1) / s;
  return k;
}

Eigen::Quaterniond ExpSO3(const Vector3& omega) {
  const double s = omega.squaredNorm();
  double w, f;  // cos(t/2), sin(t/2)/t
  const double q = 0.25 * s;
  if (q < kTinyLimit) {
    w = Horner<5>(kCosine, q);
    f = 0.5 * Horner<5>(kA, q);
  } else if (q < kSmallLimit) {
    w = Horner<8>(kCosine, q);
    f = 0.5 * Horner<8>(kA, q);
  } else {
    const double t = std::sqrt(s);
    w = std::cos(0.5 * t);
    f = std::sin(0.5 * t) / t;
  }
  return {w, f * omega.x(), f * omega.y(), f * omega.z()};
}

Vector3 LogSO3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double w = sign * q.w();
  const Vector3 v = sign * q.vec();
  const double n2 = v.squaredNorm();
  const double x = n2 / (w * w);
  if (x < kAtanLimit) return (2.0 / w * Horner<9>(kAtan, x)) * v;
  const double n = std::sqrt(n2);
  return (2.0 * std::atan2(n, w) / n) * v;
}

Pose ExpSE3(const Vector6& d) {
  const Vector3 w = d.head<3>();
  const Vector3 v = d.tail<3>();
  const ExpCoefficients k = ExpSeries(w.squaredNorm());
  const Vector3 wv = w.cross(v);
  return {ExpSO3(w), v + k.b * wv + k.c * w.cross(wv)};
}

Vector6 LogSE3(const Pose& g) {
  const Vector3 w = LogSO3(g.rotation);
  const Vector3 wp = w.cross(g.position);
  Vector6 d;
  d << w, g.position - 0.5 * wp + LogSeries(w.squaredNorm()).c * w.cross(wp);
  return d;
}

PoseAndTwist ExpAndTangent(const Vector6& d, const Vector6& x) {
  const Vector3 w = d.head<3>(), v = d.tail<3>(), a = x.head<3>(), b = x.tail<3>();
  const ExpCoefficients k = ExpSeries(w.squaredNorm());
  const Vector3 wv = w.cross(v), wa = w.cross(a), va = v.cross(a), wb = w.cross(b);
  const Vector3 wwa = w.cross(wa);
  const double dot = 2.0 * w.dot(v);
  PoseAndTwist out;
  out.pose = {ExpSO3(w), v + k.b * wv + k.c * w.cross(wv)};
  out.twist << a - k.b * wa + k.c * wwa, b - k.b * (wb + va) +
                                             k.c * (w.cross(wb + va) + v.cross(wa)) -
                                             (dot * k.b1) * wa + (dot * k.c1) * wwa;
  return out;
}

Matrix6 Adjoint(const Pose& g) {
  const Matrix3 r = g.rotation.toRotationMatrix();
  Matrix6 m;
  m << r, Matrix3::Zero(), Hat(g.position) * r, r;
  return m;
}

Vector6 AdjointInverseTimes(const Pose& g, const Vector6& eta) {
  const Matrix3 r = g.rotation.toRotationMatrix();
  Vector6 y;
  y.head<3>() = r.transpose() * eta.head<3>();
  y.tail<3>() = r.transpose() * (eta.tail<3>() - g.position.cross(eta.head<3>()));
  return y;
}

Vector6 AdjointInverseTransposeTimes(const Pose& g, const Vector6& wrench) {
  const Matrix3 r = g.rotation.toRotationMatrix();
  Vector6 y;
  y.tail<3>() = r * wrench.tail<3>();
  y.head<3>() = r * wrench.head<3>() + g.position.cross(y.tail<3>());
  return y;
}

Matrix6 SmallAdjoint(const Vector6& d) {
  Matrix6 m;
  m << Hat(d.head<3>()), Matrix3::Zero(), Hat(d.tail<3>()), Hat(d.head<3>());
  return m;
}

Matrix6 CoadjointMatrix(const Vector6& p) {
  Matrix6 m;
  m << Hat(p.head<3>()), Hat(p.tail<3>()), Hat(p.tail<3>()), Matrix3::Zero();
  return m;
}

Matrix6 TangentOperator(const Vector6& d) {
  Matrix6 m;
  for (int i = 0; i < 6; ++i) m.col(i) = TangentOperatorTimes(d, Vector6::Unit(i));
  return m;
}

Vector6 TangentOperatorTimes(const Vector6& d, const Vector6& x) {
  const Vector3 w = d.head<3>(), v = d.tail<3>(), a = x.head<3>(), b = x.tail<3>();
  const ExpCoefficients k = ExpSeries(w.squaredNorm());
  const double wv = 2.0 * w.dot(v);
  const Vector3 wa = w.cross(a), va = v.cross(a), wb = w.cross(b);
  const Vector3 wwa = w.cross(wa);
  Vector6 y;
  y.head<3>() = a - k.b * wa + k.c * wwa;
  y.tail<3>() = b - k.b * (wb + va) + k.c * (w.cross(wb) + w.cross(va) + v.cross(wa)) -
                (wv * k.b1) * wa + (wv * k.c1) * wwa;
  return y;
}

Matrix6 TangentOperatorInverse(const Vector6& d) {
  return EvenTangentInverse(d).Matrix() + 0.5 * SmallAdjoint(d);
}

Vector6 TangentOperatorInverseTimes(const Vector6& d, const Vector6& x) {
  return EvenTangentInverse(d).Times(x) + 0.5 * SmallAdjointTimes(d, x);
}

EvenTangentInverse::EvenTangentInverse(const Vector6& d)
    : omega_(d.head<3>()), v_(d.tail<3>()), k_(LogSeries(omega_.squaredNorm())) {
  MakeBlocks();
}

EvenTangentInverse::EvenTangentInverse(const Pose& g, Vector6* d)
    : omega_(LogSO3(g.rotation)), k_(LogSeries(omega_.squaredNorm())) {
  const Vector3 wp = omega_.cross(g.position);
  v_ = g.position - 0.5 * wp + k_.c * omega_.cross(wp);
  *d << omega_, v_;
  MakeBlocks();
}

void EvenTangentInverse::MakeBlocks() {
  // omega x (omega x x) = omega (omega . x) - s x
  const double s = omega_.squaredNorm();
  const double wv = omega_.dot(v_);
  ea_.noalias() = k_.c * omega_ * omega_.transpose();
  ea_.diagonal().array() += 1.0 - k_.c * s;
  eb_.noalias() = (k_.c * v_ + (2.0 * k_.c1 * wv) * omega_) * omega_.transpose();
  eb_.noalias() += (k_.c * omega_) * v_.transpose();
  eb_.diagonal().array() -= 2.0 * wv * (k_.c1 * s + k_.c);
}

Matrix6 EvenTangentInverse::Matrix() const {
  Matrix6 m;
  m << ea_, Matrix3::Zero(), eb_, ea_;
  return m;
}

Matrix3 EvenTangentInverse::FirstDerivative(const Vector3& x) const {
  const double wx = omega_.dot(x);
  const Vector3 w = wx * omega_ - omega_.squaredNorm() * x;
  Matrix3 m = (2.0 * k_.c1 * w - 2.0 * k_.c * x) * omega_.transpose();
  m.noalias() += k_.c * omega_ * x.transpose();
  m.diagonal().array() += k_.c * wx;
  return m;
}

Matrix3 EvenTangentInverse::SecondDerivative(const Vector3& x) const {
  const double wv = omega_.dot(v_), wx = omega_.dot(x), xv = x.dot(v_);
  const Vector3 w = wx * omega_ - omega_.squaredNorm() * x;
  const Vector3 z = wx * v_ + xv * omega_ - 2.0 * wv * x;  // D w [v]
  Matrix3 m = (4.0 * k_.c2 * wv * w + 2.0 * k_.c1 * z - 4.0 * k_.c1 * wv * x) * omega_.transpose();
  m.noalias() += (2.0 * k_.c1 * w - 2.0 * k_.c * x) * v_.transpose();
  m.noalias() += (2.0 * k_.c1 * wv * omega_ + k_.c * v_) * x.transpose();
  m.diagonal().array() += 2.0 * k_.c1 * wv * wx + k_.c * xv;
  return m;
}

Matrix6 EvenTangentInverse::Derivative(const Vector6& x) const {
  const Matrix3 first = FirstDerivative(x.head<3>());
  Matrix6 m;
  m.topLeftCorner<3, 3>() = first;
  m.topRightCorner<3, 3>().setZero();
  m.bottomLeftCorner<3, 3>() = FirstDerivative(x.tail<3>()) + SecondDerivative(x.head<3>());
  m.bottomRightCorner<3, 3>() = first;  // d(DEa[v] x)/dv is linear in v: the first derivative
  return m;
}

Matrix6 EvenTangentInverse::TransposeDerivative(const Vector6& sigma) const {
  const Matrix3 first = FirstDerivative(sigma.tail<3>());
  Matrix6 m;
  m.topLeftCorner<3, 3>() = FirstDerivative(sigma.head<3>()) + SecondDerivative(sigma.tail<3>());
  m.topRightCorner<3, 3>() = first;
  m.bottomLeftCorner<3, 3>() = first;
  m.bottomRightCorner<3, 3>().setZero();
  return m;
}

}  // namespace mantle::model
