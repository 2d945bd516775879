#include "model/shell_element.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "tests/support/gradient_checker.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::RandomValues;

constexpr double kPi = std::numbers::pi;
constexpr double kRoundOff = 1e-12;    // relative: complex step against analytic derivatives
constexpr double kDifferences = 1e-9;  // fourth-order differences, step 1e-3 of the scale

const ShellMaterial kElastic{1e-3, 40e3, 0.3, 40e3 / 2.6, 0.0};
const ShellMaterial kViscous{1e-3, 40e3, 0.3, 40e3 / 2.6, 500.0};

// An element of the dome, about polar angle 0.8.
struct Reference {
  ShellElement e;
  Vector3 q1, q2;
};
Reference DomeElement() {
  const double radius = 0.031, a = 0.75, b = 0.85;
  Reference out;
  out.q1 = {radius * std::sin(a), radius * std::cos(a), -a};
  out.q2 = {radius * std::sin(b), radius * std::cos(b), -b};
  out.e.chord = 2 * radius * std::sin(0.05);
  out.e.radius = 0.5 * (out.q1(0) + out.q2(0));
  out.e.area = 2 * kPi * out.e.radius * out.e.chord;
  out.e.theta = -0.8;
  out.e.sine = std::sin(out.e.theta);
  out.e.mu = -0.1 / out.e.chord;
  return out;
}

struct Case {
  Vector3 q1, q2, v1, v2;
};
Case Deformed(const Reference& ref, RandomValues* random) {
  const auto shift = [&](double length, double angle) {
    const Vector3 x = random->Cube();
    return Vector3(length * x(0), length * x(1), angle * x(2));
  };
  return {ref.q1 + shift(4e-4, 0.1), ref.q2 + shift(4e-4, 0.1), shift(0.2, 5.0), shift(0.2, 5.0)};
}

ShellElementState Evaluate(const ShellElement& e, const ShellMaterial& m, const Case& c) {
  ShellElementState s;
  EvaluateShellElement(e, m, c.q1, c.q2, c.v1, c.v2, &s);
  return s;
}

// Energy per unit reference area of [physics.md] 3, written out from r', z', theta' with complex
// arguments: nothing but the formula.
using Complex = std::complex<double>;
Complex PrintedEnergyDensity(const ShellElement& e, const ShellMaterial& m, const Complex q[6]) {
  const Complex rp = (q[3] - q[0]) / e.chord, zp = (q[4] - q[1]) / e.chord,
                mu = (q[5] - q[2]) / e.chord, r = 0.5 * (q[0] + q[3]), th = 0.5 * (q[2] + q[5]);
  const Complex lambda = rp * std::cos(th) + zp * std::sin(th);
  const Complex beta = -rp * std::sin(th) + zp * std::cos(th);
  const Complex e11 = 0.5 * (lambda * lambda + beta * beta - 1.0);
  const Complex e22 = 0.5 * (r * r / (e.radius * e.radius) - 1.0);
  const Complex d11 = e.mu - mu * lambda;
  const Complex d22 = std::sin(e.theta) / e.radius - r * std::sin(th) / (e.radius * e.radius);
  const double h = m.half_thickness_m, nu = m.poisson, j = h * h / 3.0;
  return m.young_pa * h / (1 - nu * nu) *
             (e11 * e11 + 2 * nu * e11 * e22 + e22 * e22 +
              j * (d11 * d11 + 2 * nu * d11 * d22 + d22 * d22)) +
         h * m.shear_pa * beta * beta;
}

// d/dq_i of area times the density, by complex step: exact to round-off.
Eigen::VectorXd PrintedGradient(const ShellElement& e, const ShellMaterial& m, const Case& c) {
  constexpr double kStep = 1e-30;
  Eigen::VectorXd gradient(6);
  for (int i = 0; i < 6; ++i) {
    Complex q[6];
    for (int k = 0; k < 3; ++k) {
      q[k] = c.q1(k);
      q[3 + k] = c.q2(k);
    }
    q[i] += Complex(0, kStep);
    gradient(i) = e.area * PrintedEnergyDensity(e, m, q).imag() / kStep;
  }
  return gradient;
}

Eigen::VectorXd Forces(const ShellElement& e, const ShellElementState& s) {
  Vector3 f1 = Vector3::Zero(), f2 = Vector3::Zero();
  AddShellElementForces(e, s, &f1, &f2);
  Eigen::VectorXd f(6);
  f << f1, f2;
  return f;
}

TEST(ShellElement, ReferenceShapeIsFreeOfStress) {
  const Reference ref = DomeElement();
  const ShellElementState s =
      Evaluate(ref.e, kElastic, {ref.q1, ref.q2, Vector3::Zero(), Vector3::Zero()});
  Vector5 scale;  // strains of bending scale with 1/r
  scale << 1, 1, 30, 30, 1;
  EXPECT_LT(s.strain.cwiseQuotient(scale).norm(), 1e-14);
  // On the chord of an arc the director at the ends deviates from the chord, and r' cos + z' sin =
  // 1 holds because theta* is the chord's direction.
  EXPECT_NEAR(s.lambda, 1.0, 1e-14);
}

TEST(ShellElement, ForcesAreTheGradientOfTheEnergy) {
  RandomValues random(1);
  const Reference ref = DomeElement();
  for (int i = 0; i < 20; ++i) {
    const Case c = Deformed(ref, &random);
    const Eigen::VectorXd gradient = PrintedGradient(ref.e, kElastic, c);
    const Eigen::VectorXd force = Forces(ref.e, Evaluate(ref.e, kElastic, c));
    EXPECT_LT((force + gradient).norm(), kRoundOff * gradient.norm());
    Complex q[6];
    for (int k = 0; k < 3; ++k) {
      q[k] = c.q1(k);
      q[3 + k] = c.q2(k);
    }
    const double energy = ref.e.area * PrintedEnergyDensity(ref.e, kElastic, q).real();
    EXPECT_NEAR(ShellElementEnergy(ref.e, Evaluate(ref.e, kElastic, c)), energy,
                kRoundOff * energy);
  }
}

// The resultants as [Renda] eq. 8 prints them, with errata 8, 9, 11 applied: conjugates of the
// strains per unit reference area, thickness 2h, J_s = h^2/3.
struct Resultants {
  double n_x, n_phi, m_x, m_phi, h_beta;
};
Resultants PrintedResultants(const ShellMaterial& m, const Vector5& e, const Vector5& e_dot) {
  const double h = m.half_thickness_m, nu = m.poisson, j = h * h / 3.0;
  const double k = 2 * h * m.young_pa / (1 - nu * nu);
  const double kv = 2 * h * 3 * m.viscosity_pa_s / (1 - nu * nu);
  return {k * (e(0) + nu * e(1)) + kv * (e_dot(0) + nu * e_dot(1)),
          k * (e(1) + nu * e(0)) + kv * (e_dot(1) + nu * e_dot(0)),
          k * j * (e(2) + nu * e(3)) + kv * j * (e_dot(2) + nu * e_dot(3)),
          k * j * (e(3) + nu * e(2)) + kv * j * (e_dot(3) + nu * e_dot(2)),
          2 * h * m.shear_pa * e(4) + 2 * h * m.viscosity_pa_s * e_dot(4)};
}

TEST(ShellElement, StressesAreThePrintedResultants) {
  RandomValues random(2);
  const Reference ref = DomeElement();
  const Case c = Deformed(ref, &random);
  const ShellElementState s = Evaluate(ref.e, kViscous, c);
  const Resultants p = PrintedResultants(kViscous, s.strain, s.strain_rate);
  const Vector5 stress = s.elastic + s.viscous;
  EXPECT_NEAR(stress(0), p.n_x, kRoundOff * std::abs(p.n_x));
  EXPECT_NEAR(stress(1), p.n_phi, kRoundOff * std::abs(p.n_phi));
  EXPECT_NEAR(stress(2), p.m_x, kRoundOff * std::abs(p.m_x));
  EXPECT_NEAR(stress(3), p.m_phi, kRoundOff * std::abs(p.m_phi));
  EXPECT_NEAR(stress(4), p.h_beta, kRoundOff * std::abs(p.h_beta));
}

TEST(ShellElement, ForceOfTheMeridianIsThePrintedShearAndMembraneForce) {
  // In a frame along and across the director: f2 . e_lambda and f2 . e_beta of a unit meridian are
  //   N = N_X lambda - M_X mu,  H = 2h [G beta + eta beta_dot] + N_X beta
  // per unit of reference circumference; H's viscous part is erratum 11.
  RandomValues random(3);
  const Reference ref = DomeElement();
  const Case c = Deformed(ref, &random);
  const ShellElementState s = Evaluate(ref.e, kViscous, c);
  Vector3 f1 = Vector3::Zero(), f2 = Vector3::Zero();
  AddShellElementForces(ref.e, s, &f1, &f2);
  const Vector3 pull = -0.5 * (f2 - f1);  // the slope part; hoop forces cancel in the difference
  const double circumference = ref.e.area / ref.e.chord;
  const double along = (pull(0) * s.cosine + pull(1) * s.sine) / circumference;
  const double across = (-pull(0) * s.sine + pull(1) * s.cosine) / circumference;
  const double h = kViscous.half_thickness_m, nu = kViscous.poisson, eta = kViscous.viscosity_pa_s;
  const Resultants p = PrintedResultants(kViscous, s.strain, s.strain_rate);
  EXPECT_NEAR(along, p.n_x * s.lambda - p.m_x * s.y(2), 1e-11 * std::abs(along));
  const double beta = s.strain(4);
  const double elastic = 2 * h *
                         (kViscous.shear_pa * beta + kViscous.young_pa / (1 - nu * nu) * beta *
                                                         (s.strain(0) + nu * s.strain(1)));
  const double viscous = 2 * h *
                         (eta * s.strain_rate(4) + 3 * eta / (1 - nu * nu) * beta *
                                                       (s.strain_rate(0) + nu * s.strain_rate(1)));
  EXPECT_NEAR(across, elastic + viscous, 1e-11 * (std::abs(elastic) + std::abs(viscous)));
}

TEST(ShellElement, StrainRatesAreDerivativesOfStrains) {
  RandomValues random(4);
  const Reference ref = DomeElement();
  const Case c = Deformed(ref, &random);
  const ShellElementState s = Evaluate(ref.e, kViscous, c);
  const auto strain = [&](double t) -> Vector5 {
    return Evaluate(ref.e, kViscous, {c.q1 + t * c.v1, c.q2 + t * c.v2, c.v1, c.v2}).strain;
  };
  EXPECT_TRUE(
      tests::JacobianMatches(s.strain_rate, tests::DifferenceRate(strain, 1e-5), kDifferences));
}

TEST(ShellElement, ForcesDoMinusTheStressPower) {
  RandomValues random(5);
  const Reference ref = DomeElement();
  for (int i = 0; i < 20; ++i) {
    const Case c = Deformed(ref, &random);
    const ShellElementState s = Evaluate(ref.e, kViscous, c);
    Vector3 f1 = Vector3::Zero(), f2 = Vector3::Zero();
    AddShellElementForces(ref.e, s, &f1, &f2);
    const double power = ShellElementStressPower(ref.e, s) + ShellElementDissipation(ref.e, s);
    EXPECT_NEAR(f1.dot(c.v1) + f2.dot(c.v2), -power,
                kRoundOff * (f1.norm() * c.v1.norm() + f2.norm() * c.v2.norm()));
  }
}

TEST(ShellElement, DissipationIsNeverNegative) {
  RandomValues random(6);
  const Reference ref = DomeElement();
  for (int i = 0; i < 200; ++i) {
    const Case c = Deformed(ref, &random);
    EXPECT_GT(ShellElementDissipation(ref.e, Evaluate(ref.e, kViscous, c)), 0.0);
    EXPECT_EQ(ShellElementDissipation(ref.e, Evaluate(ref.e, kElastic, c)), 0.0);
  }
}

TEST(ShellElement, AxialTranslationMakesNoForce) {
  // The one rigid motion an axisymmetric shell has, at rest and deformed.
  RandomValues random(7);
  const Reference ref = DomeElement();
  const Case c = Deformed(ref, &random);
  const Vector3 shift(0, 0.37, 0), speed(0, 1.3, 0);
  const Eigen::VectorXd before = Forces(ref.e, Evaluate(ref.e, kViscous, c));
  const Eigen::VectorXd after = Forces(
      ref.e, Evaluate(ref.e, kViscous, {c.q1 + shift, c.q2 + shift, c.v1 + speed, c.v2 + speed}));
  EXPECT_LT((after - before).norm(), 1e-10 * before.norm());  // 0.37 m against 3 mm: two digits
  const ShellElementState rest =
      Evaluate(ref.e, kViscous, {ref.q1 + shift, ref.q2 + shift, speed, speed});
  Vector5 scale;
  scale << 1, 1, 30, 30, 1;
  EXPECT_LT(rest.strain.cwiseQuotient(scale).norm(), 1e-12);
  EXPECT_TRUE(rest.strain_rate.isZero(1e-12));
  EXPECT_EQ(before(1), -before(4));  // no net axial force
}

TEST(ShellElement, FlatPlateBendsFlatOnlyWithoutInPlaneStrain) {
  // A plate element turned as a rigid line (a cone) strains its hoop only through r and theta.
  ShellElement e{0.002, 2 * kPi * 0.02 * 0.002, 0.02, 0.0, 0.0};
  const double angle = 1e-4;
  const Case c{{0.019, 0, angle},
               {0.019 + 0.002 * std::cos(angle), 0.002 * std::sin(angle), angle},
               Vector3::Zero(),
               Vector3::Zero()};
  const ShellElementState s = Evaluate(e, kElastic, c);
  EXPECT_NEAR(s.strain(0), 0.0, 1e-14);
  EXPECT_NEAR(s.strain(2), 0.0, 1e-12);
  EXPECT_NEAR(s.strain(3), -angle / 0.02, 1e-6 * angle / 0.02);  // hoop curvature of a cone
  EXPECT_NEAR(s.strain(4), 0.0, 1e-14);
}

TEST(ShellElement, TangentsMatchDifferences) {
  RandomValues random(8);
  const Reference ref = DomeElement();
  for (const ShellMaterial& m : {kElastic, kViscous}) {
    for (double damping_scale : {0.0, 341.0}) {
      const Case c = Deformed(ref, &random);
      const auto force = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
        const Vector3 d1 = x.head<3>(), d2 = x.tail<3>();
        return Forces(ref.e, Evaluate(ref.e, m,
                                      {c.q1 + d1, c.q2 + d2, c.v1 + damping_scale * d1,
                                       c.v2 + damping_scale * d2}));
      };
      Eigen::VectorXd step(6);
      step << 1e-6, 1e-6, 1e-3, 1e-6, 1e-6, 1e-3;
      const Eigen::MatrixXd numeric =
          -tests::DifferenceJacobian(force, Eigen::VectorXd::Zero(6), step);
      ShellElementTangent t;
      ShellElementTangents(ref.e, m, Evaluate(ref.e, m, c), damping_scale, &t);
      Eigen::MatrixXd analytic(6, 6);
      analytic << t.a11, t.a12, t.a21, t.a22;
      EXPECT_TRUE(tests::JacobianMatches(analytic, numeric, kDifferences))
          << "viscosity " << m.viscosity_pa_s << " damping scale " << damping_scale;
    }
  }
}

}  // namespace
}  // namespace mantle::model
