#include "model/shell_element.h"

#include <cmath>

namespace mantle::model {
namespace {

// Rows: d strain / d y. Only the shape of the strains enters, not the material.
Matrix5 StrainGradient(const ShellElement& e, const ShellElementState& s) {
  const double a = s.y(0), b = s.y(1), mu = s.y(2), r = s.y(3), beta = s.strain(4);
  const double k = 1.0 / (e.radius * e.radius);
  Matrix5 g = Matrix5::Zero();
  g(0, 0) = a;
  g(0, 1) = b;
  g(1, 3) = r * k;
  g(2, 0) = -mu * s.cosine;
  g(2, 1) = -mu * s.sine;
  g(2, 2) = -s.lambda;
  g(2, 4) = -mu * beta;
  g(3, 3) = -s.sine * k;
  g(3, 4) = -r * s.cosine * k;
  g(4, 0) = -s.sine;
  g(4, 1) = s.cosine;
  g(4, 4) = -s.lambda;
  return g;
}

// Sum over strains of stress_k times the Hessian of strain_k in y.
Matrix5 WeightedHessian(const ShellElement& e, const ShellElementState& s, const Vector5& stress) {
  const double mu = s.y(2), r = s.y(3), beta = s.strain(4);
  const double k = 1.0 / (e.radius * e.radius);
  Matrix5 h = Matrix5::Zero();
  h(0, 0) = h(1, 1) = stress(0);
  h(3, 3) = stress(1) * k;
  h(0, 2) = h(2, 0) = -stress(2) * s.cosine;
  h(1, 2) = h(2, 1) = -stress(2) * s.sine;
  h(2, 4) = h(4, 2) = -stress(2) * beta;
  h(0, 4) = h(4, 0) = stress(2) * mu * s.sine - stress(4) * s.cosine;
  h(1, 4) = h(4, 1) = -stress(2) * mu * s.cosine - stress(4) * s.sine;
  h(4, 4) = stress(2) * mu * s.lambda + stress(3) * r * s.sine * k - stress(4) * beta;
  h(3, 4) = h(4, 3) = -stress(3) * s.cosine * k;
  return h;
}

// Rows: d strain_rate / d y, strain_rate = (d strain/d y)(y) y_dot: rows (Hessian_k y_dot)^T.
Matrix5 StrainRateGradient(const ShellElement& e, const ShellElementState& s) {
  const double mu = s.y(2), r = s.y(3), beta = s.strain(4);
  const double ad = s.y_dot(0), bd = s.y_dot(1), mud = s.y_dot(2), rd = s.y_dot(3), td = s.y_dot(4);
  const double k = 1.0 / (e.radius * e.radius);
  Matrix5 g = Matrix5::Zero();
  g(0, 0) = ad;
  g(0, 1) = bd;
  g(1, 3) = rd * k;
  g(2, 0) = -mud * s.cosine + mu * s.sine * td;
  g(2, 1) = -mud * s.sine - mu * s.cosine * td;
  g(2, 2) = -ad * s.cosine - bd * s.sine - beta * td;
  g(2, 4) = -mud * beta + mu * (ad * s.sine - bd * s.cosine + s.lambda * td);
  g(3, 3) = -s.cosine * td * k;
  g(3, 4) = (r * s.sine * td - s.cosine * rd) * k;
  g(4, 0) = -s.cosine * td;
  g(4, 1) = -s.sine * td;
  g(4, 4) = -s.cosine * ad - s.sine * bd - beta * td;
  return g;
}

// Symmetric material matrix of the quadratic form, applied: stress = C strain.
Vector5 Apply(double membrane, double bending, double shear, double nu, const Vector5& x) {
  return Vector5(membrane * (x(0) + nu * x(1)), membrane * (x(1) + nu * x(0)),
                 bending * (x(2) + nu * x(3)), bending * (x(3) + nu * x(2)), shear * x(4));
}

struct Moduli {
  double membrane, bending, shear;
};
Moduli Elastic(const ShellMaterial& m) {
  const double k = 2.0 * m.young_pa * m.half_thickness_m / (1.0 - m.poisson * m.poisson);
  return {k, k * m.half_thickness_m * m.half_thickness_m / 3.0,
          2.0 * m.half_thickness_m * m.shear_pa};
}
Moduli Viscous(const ShellMaterial& m) {
  const double k = 6.0 * m.viscosity_pa_s * m.half_thickness_m / (1.0 - m.poisson * m.poisson);
  return {k, k * m.half_thickness_m * m.half_thickness_m / 3.0,
          2.0 * m.half_thickness_m * m.viscosity_pa_s};
}

Matrix5 Apply(const Moduli& c, double nu, const Matrix5& x) {
  Matrix5 y;
  y.row(0) = c.membrane * (x.row(0) + nu * x.row(1));
  y.row(1) = c.membrane * (x.row(1) + nu * x.row(0));
  y.row(2) = c.bending * (x.row(2) + nu * x.row(3));
  y.row(3) = c.bending * (x.row(3) + nu * x.row(2));
  y.row(4) = c.shear * x.row(4);
  return y;
}

// g^T x for a strain gradient g, of whose entries thirteen are not zero.
Matrix5 GradientTransposeTimes(const Matrix5& g, const Matrix5& x) {
  Matrix5 y;
  y.row(0) = g(0, 0) * x.row(0) + g(2, 0) * x.row(2) + g(4, 0) * x.row(4);
  y.row(1) = g(0, 1) * x.row(0) + g(2, 1) * x.row(2) + g(4, 1) * x.row(4);
  y.row(2) = g(2, 2) * x.row(2);
  y.row(3) = g(1, 3) * x.row(1) + g(3, 3) * x.row(3);
  y.row(4) = g(2, 4) * x.row(2) + g(3, 4) * x.row(3) + g(4, 4) * x.row(4);
  return y;
}

// -(df_y/dy + damping_scale df_y/dy_dot), f_y the force conjugate to y.
Matrix5 StrainTangent(const ShellElement& e, const ShellMaterial& m, const ShellElementState& s,
                      double damping_scale) {
  const Matrix5 g = StrainGradient(e, s);
  Matrix5 dstress = Apply(Elastic(m), m.poisson, g);
  if (m.viscosity_pa_s > 0.0) {
    const Matrix5 rate_by_y = StrainRateGradient(e, s);
    dstress += Apply(Viscous(m), m.poisson, (rate_by_y + damping_scale * g).eval());
  }
  return e.area *
         (GradientTransposeTimes(g, dstress) + WeightedHessian(e, s, s.elastic + s.viscous));
}

}  // namespace

void EvaluateShellElement(const ShellElement& e, const ShellMaterial& m, const Vector3& q1,
                          const Vector3& q2, const Vector3& v1, const Vector3& v2,
                          ShellElementState* state) {
  ShellElementState& s = *state;
  const double inv = 1.0 / e.chord;
  s.y << (q2 - q1) * inv, 0.5 * (q1(0) + q2(0)), 0.5 * (q1(2) + q2(2));
  s.y_dot << (v2 - v1) * inv, 0.5 * (v1(0) + v2(0)), 0.5 * (v1(2) + v2(2));
  EvaluateShellStrains(e, m, state);
}

void EvaluateShellStrains(const ShellElement& e, const ShellMaterial& m, ShellElementState* state) {
  ShellElementState& s = *state;
  const double a = s.y(0), b = s.y(1), mu = s.y(2), r = s.y(3), theta = s.y(4);
  s.sine = std::sin(theta);
  s.cosine = std::cos(theta);
  s.lambda = a * s.cosine + b * s.sine;
  const double beta = -a * s.sine + b * s.cosine;
  const double k = 1.0 / (e.radius * e.radius);
  s.strain << 0.5 * (a * a + b * b - 1.0), 0.5 * (r * r * k - 1.0), e.mu - mu * s.lambda,
      e.sine / e.radius - r * s.sine * k, beta;

  const double ad = s.y_dot(0), bd = s.y_dot(1), mud = s.y_dot(2), rd = s.y_dot(3), td = s.y_dot(4);
  const double lambda_dot = ad * s.cosine + bd * s.sine + beta * td;
  s.strain_rate << a * ad + b * bd, r * rd * k, -mud * s.lambda - mu * lambda_dot,
      -(rd * s.sine + r * s.cosine * td) * k, -ad * s.sine + bd * s.cosine - s.lambda * td;

  const Moduli c = Elastic(m);
  s.elastic = Apply(c.membrane, c.bending, c.shear, m.poisson, s.strain);
  if (m.viscosity_pa_s > 0.0) {
    const Moduli cv = Viscous(m);
    s.viscous = Apply(cv.membrane, cv.bending, cv.shear, m.poisson, s.strain_rate);
  } else {
    s.viscous.setZero();
  }
}

Vector5 ShellStrainForce(const ShellElement& e, const ShellElementState& s) {
  const Vector5 stress = s.elastic + s.viscous;
  const double a = s.y(0), b = s.y(1), mu = s.y(2), r = s.y(3), beta = s.strain(4);
  const double k = 1.0 / (e.radius * e.radius);
  Vector5 f;
  f << stress(0) * a - stress(2) * mu * s.cosine - stress(4) * s.sine,
      stress(0) * b - stress(2) * mu * s.sine + stress(4) * s.cosine, -stress(2) * s.lambda,
      k * (stress(1) * r - stress(3) * s.sine),
      -stress(2) * mu * beta - stress(3) * r * s.cosine * k - stress(4) * s.lambda;
  return -e.area * f;
}

void AddShellElementForces(const ShellElement& e, const ShellElementState& s, Vector3* f1,
                           Vector3* f2) {
  const Vector5 f = ShellStrainForce(e, s);
  const Vector3 slope = f.head<3>() / e.chord;
  const Vector3 mean(0.5 * f(3), 0.0, 0.5 * f(4));
  *f1 += mean - slope;
  *f2 += mean + slope;
}

void ShellStrainTangents(const ShellElement& e, const ShellMaterial& m, const ShellElementState& s,
                         Matrix5* stiffness, Matrix5* damping) {
  *stiffness = StrainTangent(e, m, s, 0.0);
  damping->setZero();
  if (m.viscosity_pa_s == 0.0) return;
  const Matrix5 g = StrainGradient(e, s);
  *damping = e.area * GradientTransposeTimes(g, Apply(Viscous(m), m.poisson, g));
}

void ShellElementTangents(const ShellElement& e, const ShellMaterial& m, const ShellElementState& s,
                          double damping_scale, ShellElementTangent* out) {
  const Matrix5 t = StrainTangent(e, m, s, damping_scale);
  // Nodes: y = (dr/c, dz/c, dtheta/c, mean r, mean theta). With S the slope block, F the slope-mean
  // blocks carried to (r, z, theta), and G the mean block:
  const double inv = 1.0 / e.chord;
  const Matrix3 slope = inv * inv * t.topLeftCorner<3, 3>();
  Matrix3 right = Matrix3::Zero(), left = Matrix3::Zero(), mean = Matrix3::Zero();
  right.col(0) = 0.5 * inv * t.col(3).head<3>();
  right.col(2) = 0.5 * inv * t.col(4).head<3>();
  left.row(0) = 0.5 * inv * t.row(3).head<3>();
  left.row(2) = 0.5 * inv * t.row(4).head<3>();
  mean(0, 0) = 0.25 * t(3, 3);
  mean(0, 2) = 0.25 * t(3, 4);
  mean(2, 0) = 0.25 * t(4, 3);
  mean(2, 2) = 0.25 * t(4, 4);
  out->a11 = slope - right - left + mean;
  out->a12 = -slope - right + left + mean;
  out->a21 = -slope + right - left + mean;
  out->a22 = slope + right + left + mean;
}

double ShellElementEnergy(const ShellElement& e, const ShellElementState& s) {
  return 0.5 * e.area * s.elastic.dot(s.strain);
}
double ShellElementStressPower(const ShellElement& e, const ShellElementState& s) {
  return e.area * s.elastic.dot(s.strain_rate);
}
double ShellElementDissipation(const ShellElement& e, const ShellElementState& s) {
  return e.area * s.viscous.dot(s.strain_rate);
}

}  // namespace mantle::model
