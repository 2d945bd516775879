#include "model/mantle_inertia.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/gradient_checker.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::RandomValues;

constexpr double kRoundOff = 1e-12;    // relative, sums over some tens of nodes
constexpr double kDifferences = 1e-9;  // fourth-order differences, step 1e-3 of the scale

struct MovingMantle {
  Shell shell;
  MantleWaterOptions options;
  std::vector<Vector3> q, v;
  Vector6 twist;
};

MovingMantle Make(bool added_mass, bool lateral, bool contained, unsigned seed) {
  RandomValues random(seed);
  Effects effects;
  effects.added_mass = added_mass;
  MovingMantle s{MakeShell(tests::PaperMantle(16), Water{}, effects),
                 {1022.0, lateral, contained, 2.64e-5},
                 {},
                 {},
                 random.Twist(3.0, 0.5)};
  s.q = s.shell.reference;
  for (Vector3& q : s.q) {
    q += Vector3(1e-3, 2e-3, 0.1).cwiseProduct(random.Cube());
    s.v.push_back(Vector3(0.1, 0.1, 3.0).cwiseProduct(random.Cube()));
  }
  return s;
}

// T of the header and of [physics.md] 4, summed node by node and slice by slice; the cavity's
// moments by Gauss-Legendre with three points per slice (the header's slices carry their mean
// height).
double PrintedEnergy(const MovingMantle& s, const std::vector<Vector3>& q,
                     const std::vector<Vector3>& v, const Vector6& eta) {
  const double w1 = eta(0), w2 = eta(1), w3 = eta(2), v1 = eta(3), v2 = eta(4), v3 = eta(5);
  const double b = s.shell.added_mass_factor;
  const double lateral = s.options.lateral_added_mass ? 1.0 : 1.0 + b;
  double t = 0;
  for (std::size_t j = 0; j < q.size(); ++j) {
    const double m = s.shell.nodes[j].mass_kg, r = q[j](0), z = q[j](1);
    t += 0.5 * m * (1 + b) *
         (std::pow(v[j](0), 2) + std::pow(v3 + v[j](1), 2) + 0.5 * r * r * (w1 * w1 + w2 * w2) +
          r * r * w3 * w3);
    t += 0.5 * m * 1e-6 / 3.0 * std::pow(v[j](2), 2);
    t += 0.5 * m * lateral * (std::pow(v1 + w2 * z, 2) + std::pow(v2 - w1 * z, 2));
  }
  double volume = 0, moment = 0;
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double a = q[i](0), c = q[i + 1](0);
    const double slice = std::numbers::pi / 3.0 * (a * a + a * c + c * c) * (q[i](1) - q[i + 1](1));
    const double z = 0.5 * (q[i](1) + q[i + 1](1));
    volume += slice;
    moment += slice * z;
    if (s.options.lateral_added_mass) {
      t += 0.5 * 1022.0 * slice * (std::pow(v1 + w2 * z, 2) + std::pow(v2 - w1 * z, 2));
    }
  }
  if (s.options.contained_water) {
    const double m = 1022.0 * (volume - s.options.solid_volume_m3), z = moment / volume;
    t += 0.5 * m * (std::pow(v1 + w2 * z, 2) + std::pow(v2 - w1 * z, 2));
  }
  return t;
}

Matrix6 RootInertia(const MovingMantle& s, const std::vector<Vector3>& q, bool rates) {
  Matrix6 m = Matrix6::Zero();
  AddMantleInertia(EvaluateMantleInertia(s.shell, s.options, q, s.v.data()), rates, &m);
  return m;
}

template <typename Visit>
void ForEachOption(Visit visit) {
  unsigned seed = 1;
  for (bool added : {false, true}) {
    for (bool lateral : {false, true}) {
      for (bool contained : {false, true}) visit(Make(added, lateral, contained, seed++));
    }
  }
}

TEST(MantleInertia, RootInertiaIsTheHessianOfTheEnergy) {
  ForEachOption([](const MovingMantle& s) {
    const Matrix6 m = RootInertia(s, s.q, false);
    // T is quadratic in the twist: polarisation is exact.
    const std::vector<Vector3> still(s.q.size(), Vector3::Zero());
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 6; ++k) {
        const Vector6 a = Vector6::Unit(i), b = Vector6::Unit(k);
        const double hessian = PrintedEnergy(s, s.q, still, a + b) -
                               PrintedEnergy(s, s.q, still, a) - PrintedEnergy(s, s.q, still, b);
        EXPECT_NEAR(m(i, k), hessian, kRoundOff) << i << " " << k;
      }
    }
  });
}

TEST(MantleInertia, AxialMomentumCouplesTheShape) {
  ForEachOption([](const MovingMantle& s) {
    const std::vector<Vector3> still(s.q.size(), Vector3::Zero());
    const Vector6 e = Vector6::Unit(5);
    const double cross = PrintedEnergy(s, s.q, s.v, e) - PrintedEnergy(s, s.q, still, e) -
                         PrintedEnergy(s, s.q, s.v, Vector6::Zero());
    EXPECT_NEAR(EvaluateMantleInertia(s.shell, s.options, s.q, s.v.data()).axial_momentum, cross,
                kRoundOff);
  });
}

TEST(MantleInertia, RatesMatchDifferences) {
  ForEachOption([](const MovingMantle& s) {
    const auto inertia = [&](double t) -> Matrix6 {
      std::vector<Vector3> q = s.q;
      for (std::size_t j = 0; j < q.size(); ++j) q[j] += t * s.v[j];
      return RootInertia(s, q, false);
    };
    EXPECT_TRUE(tests::JacobianMatches(RootInertia(s, s.q, true),
                                       tests::DifferenceRate(inertia, 1e-4), kDifferences, 1e-12));
  });
}

TEST(MantleInertia, CentrifugalForcesAreTheGradientOfTheEnergy) {
  ForEachOption([](const MovingMantle& s) {
    // Contained water: its mass is not free to follow the shape ([physics.md] 3, mantle_inertia.h):
    // dT/dq at constant mass.
    if (s.options.contained_water) return;
    const auto energy = [&](const Eigen::VectorXd& x) {
      std::vector<Vector3> q = s.q;
      for (std::size_t j = 0; j < q.size(); ++j) q[j] += x.segment<3>(3 * static_cast<long>(j));
      return PrintedEnergy(s, q, s.v, s.twist);
    };
    const long n = 3 * static_cast<long>(s.q.size());
    const Eigen::MatrixXd numeric = tests::DifferenceJacobian(energy, Eigen::VectorXd::Zero(n),
                                                              Eigen::VectorXd::Constant(n, 1e-5));
    std::vector<Vector3> f(s.q.size(), Vector3::Zero());
    AddCentrifugalForces(s.shell, s.options,
                         EvaluateMantleInertia(s.shell, s.options, s.q, s.v.data()),
                         EvaluateCavity(s.q, s.v.data()), s.q, s.twist, f.data());
    const Eigen::Map<const Eigen::VectorXd> flat(f.front().data(), n);
    EXPECT_TRUE(tests::JacobianMatches(flat.transpose(), numeric, kDifferences, 1e-10));
  });
}

TEST(MantleInertia, ContainedWaterPushesThroughItsCentroidAlone) {
  const MovingMantle s = Make(false, false, true, 9);
  std::vector<Vector3> with(s.q.size(), Vector3::Zero()), without = with;
  const CavityMoments cavity = EvaluateCavity(s.q, s.v.data());
  const MantleInertia m = EvaluateMantleInertia(s.shell, s.options, s.q, s.v.data());
  AddCentrifugalForces(s.shell, s.options, m, cavity, s.q, s.twist, with.data());
  MantleWaterOptions dry = s.options;
  dry.contained_water = false;
  AddCentrifugalForces(s.shell, dry, m, cavity, s.q, s.twist, without.data());
  // m_w/2 d|u(z_c)|^2/dz_c, times dz_c/dq by differences of the centroid
  const double u1 = s.twist(3) + s.twist(1) * m.centroid_m;
  const double u2 = s.twist(4) - s.twist(0) * m.centroid_m;
  const double push = m.contained_kg * (u1 * s.twist(1) - u2 * s.twist(0));
  const auto centroid = [&](const Eigen::VectorXd& x) {
    std::vector<Vector3> q = s.q;
    for (std::size_t j = 0; j < q.size(); ++j) q[j] += x.segment<3>(3 * static_cast<long>(j));
    const CavityMoments c = EvaluateCavity(q, s.v.data());
    return push * c.v[1] / c.v[0];
  };
  const long n = 3 * static_cast<long>(s.q.size());
  const Eigen::MatrixXd numeric = tests::DifferenceJacobian(centroid, Eigen::VectorXd::Zero(n),
                                                            Eigen::VectorXd::Constant(n, 1e-5));
  Eigen::VectorXd flat(n);
  for (std::size_t j = 0; j < s.q.size(); ++j) {
    flat.segment<3>(3 * static_cast<long>(j)) = with[j] - without[j];
  }
  EXPECT_TRUE(tests::JacobianMatches(flat.transpose(), numeric, kDifferences, 1e-10));
}

TEST(MantleInertia, ContainedWaterOfThePaperIs296Millilitres) {  // [physics.md] 3: 0.30 kg
  MovingMantle s = Make(false, false, true, 1);
  s.shell = MakeShell(tests::PaperMantle(128), Water{}, Effects{});
  const std::vector<Vector3> still(s.shell.nodes.size(), Vector3::Zero());
  const MantleInertia m =
      EvaluateMantleInertia(s.shell, s.options, s.shell.reference, still.data());
  EXPECT_NEAR(m.contained_kg, 1.022 * 0.296, 0.001);
}

TEST(MantleInertia, OutflowTakesTheLipsMomentumAndInflowBringsNone) {
  RandomValues random(3);
  const Vector6 twist = random.Twist(2, 0.5);
  MantleInertia m;
  m.contained_rate_kg_s = -0.4;
  const double z = -0.11;
  const Vector6 w = OutflowWrench(m, z, twist);
  const Vector3 lip = twist.tail<3>() + twist.head<3>().cross(Vector3(0, 0, z));
  const Vector3 force = -0.4 * Vector3(lip.x(), lip.y(), 0.0);
  EXPECT_LT((w.tail<3>() - force).norm(), 1e-15);
  EXPECT_LT((w.head<3>() - Vector3(0, 0, z).cross(force)).norm(), 1e-15);
  m.contained_rate_kg_s = 0.4;
  EXPECT_TRUE(OutflowWrench(m, z, twist).isZero(0.0));
}

TEST(MantleInertia, CavityMomentsConvergeToTheCylinder) {
  Mantle tube;
  tube.name = "tube";
  tube.r0_m = 0.03;
  tube.theta0_rad = -std::numbers::pi / 2;
  tube.pieces = {{0.1, 0.0}};
  tube.half_thickness_m = 1e-3;
  tube.material = {40e3, 0, 0, 1022};
  tube.elements = 50;
  const Shell shell = MakeShell(tube, Water{}, Effects{});
  const std::vector<Vector3> still(shell.nodes.size(), Vector3::Zero());
  const CavityMoments c = EvaluateCavity(shell.reference, still.data());
  const double section = std::numbers::pi * 0.03 * 0.03;
  EXPECT_NEAR(c.v[0], section * 0.1, 1e-16);
  EXPECT_NEAR(c.v[1], -section * 0.005, 1e-17);
  EXPECT_NEAR(c.v[2], section * 1e-3 / 3.0, 1e-4 * section * 1e-3);  // midpoints: 1/(4 n^2)
}

}  // namespace
}  // namespace mantle::model
