// A neutral section feels no gravity, a heavy one its weight.
#include "model/loads.h"

int main() {
  using namespace mantle::model;
  const SectionGeometry section{0.1, 1e-4, 5e-3};
  const SectionMotion at_rest{Eigen::Quaterniond::Identity(), Vector6::Zero()};
  const GravityLoad neutral{Vector3(0, 0, -9.81), 1000, 1000}, heavy{Vector3(0, 0, -9.81), 2000, 0};
  return neutral.Density(section, at_rest).isZero() && heavy.Density(section, at_rest)(5) < -1.9
             ? 0
             : 1;
}
