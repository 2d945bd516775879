#include "model/rigid_body.h"

#include <numbers>

namespace mantle::model {
namespace {
constexpr double kPi = std::numbers::pi;
}

double RigidVolume(const RigidBody& body) {
  if (const Cone* cone = std::get_if<Cone>(&body.shape)) {
    return kPi * cone->radius_m * cone->radius_m * cone->height_m / 3.0;
  }
  return std::get<GivenInertia>(body.shape).volume_m3;
}

double RigidMass(const RigidBody& body) {
  if (const Cone* cone = std::get_if<Cone>(&body.shape)) {
    return cone->density_kg_m3 * RigidVolume(body);
  }
  return std::get<GivenInertia>(body.shape).mass_kg;
}

Vector3 RigidCentre(const RigidBody& body) {
  if (const Cone* cone = std::get_if<Cone>(&body.shape)) return {0, 0, -0.75 * cone->height_m};
  return std::get<GivenInertia>(body.shape).centre_m;
}

Matrix6 RigidInertia(const RigidBody& body) {
  const double mass = RigidMass(body);
  const Matrix3 u = Hat(RigidCentre(body));
  Matrix3 about_origin;
  if (const Cone* cone = std::get_if<Cone>(&body.shape)) {
    const double h2 = cone->radius_m * cone->radius_m;
    const double l2 = cone->height_m * cone->height_m;
    const double jr = 3.0 * (h2 / 4.0 + l2) / 5.0;
    about_origin = mass * Vector3(jr, jr, 3.0 * h2 / 10.0).asDiagonal();
  } else {
    about_origin = std::get<GivenInertia>(body.shape).inertia_kg_m2 - mass * u * u;
  }
  Matrix6 m;
  m << about_origin, mass * u, -mass * u, mass * Matrix3::Identity();
  return m;
}

}  // namespace mantle::model
