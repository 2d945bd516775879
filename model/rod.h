#pragma once

#include <stdexcept>
#include <vector>

#include "model/loads.h"
#include "model/muscle.h"
#include "model/robot.h"
#include "model/rod_element.h"
#include "model/root_loads.h"

namespace mantle::model {

/// A robot that cannot be: names the value and the bound. `path` is completed by the scene reader.
struct BadRobot : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// A node of an arm with the mass that is lumped on it; or, from ArmSection, a section with its
/// share of the arm's length.
struct RodNode {
  double weight_m{0};                ///< integral of the place's L_k
  SectionGeometry section;           ///< means with that weight
  Vector6 inertia{Vector6::Zero()};  ///< diagonal, solid [kg m^2, kg]
  double added_mass_kg{0};           ///< in the two lateral directions; zero without the effect
  double ahead_m{0};                 ///< of the frame that carries it, along e1

  /// Diagonal of solid and added inertia together.
  Vector6 FullInertia() const {
    Vector6 m = inertia;
    m.tail<2>().array() += added_mass_kg;
    return m;
  }
};

/// A payload on a node: its own inertia, and what acts on it, about the node's origin. Inertia and
/// loads count while it is attached (PlantInputs::payloads).
struct RodPayload {
  int node;
  Payload payload;
  Matrix6 inertia;  ///< screw inertia about the node's origin, section axes
  std::vector<RootLoad> loads;
  int power_place{-1};
};

/// Where a cable crosses an element: position and slope of its path in the section frame, at the
/// midpoint of the covered part, and that part's share of the element.
struct CablePiece {
  Vector3 offset_m, slope;  ///< y and z; d(offset)/dX
  double share;             ///< 0 to 1
};

/// Section of an arm at arc length x, as the scene describes it: strain at rest, diagonals of
/// stiffness and (with the effect) viscosity, and the share `weight_m` of length with its geometry
/// and inertia. The plant integrates these over its elements and nodes, the reduced model takes
/// them at its quadrature points.
Vector6 ArmRestStrain(const Arm& arm, double x_m);
Vector6 ArmStiffness(const Arm& arm, double x_m);
/// What couples the strains: the stiffness without its diagonal.
Matrix6 ArmStiffnessCoupling(const Arm& arm, double x_m);
Vector6 ArmViscosity(const Arm& arm, const Effects& effects, double x_m);
RodNode ArmSection(const Arm& arm, const Water& water, const Effects& effects, double x_m,
                   double weight_m);
/// Path of a cable at arc length x, with share 1.
CablePiece ArmCablePath(const Arm& arm, const ArmCable& cable, double x_m);

/// A cable of an arm on the arm's mesh.
struct RodCable {
  std::string name;
  std::vector<CablePiece> pieces;  ///< elements 0, 1, ... up to the cable's end
  double rest_length_m{0};
  CableDrive drive;
  int power_place{-1};  ///< see PowerNames; as of every load here
};

/// A point wrench at the node of its place.
struct RodPoint {
  int node;
  PointWrench load;
  int power_place{-1};
};

/// A muscle, with the place of its power among the names.
struct RodMuscle {
  MuscleWave wave;
  int power_place{-1};
};

/// An arm discretised: N elements of constant strain between N+1 nodes. Node 0 is the base. Mass
/// and loads sit at nodes and at one place inside each element, which the frame half-way along it
/// carries (model/rod_middle.h): the Gauss-Lobatto rule with the mass per length as its weight,
///
///   s* = int m s^2 (1 - s) ds / int m s (1 - s) ds,   m_k = int m L_k ds,   L_k Lagrange's
///   polynomials on (0, s*, 1),
///
/// positive for any m and exact to degree 3 (W. Gautschi, Orthogonal Polynomials, 2004, 3.1.1.3):
/// mass, its first and its second moment are those of the solid, so that rigid motion is exact with
/// any number of elements. Uniform mass gives Simpson's 1/6, 4/6, 1/6, and with the bending of
/// model/rod_element.h frequencies of fourth order. The sections' own rotary inertia is 2/3 at the
/// nodes (linear) and 1/3 inside, which makes torsional waves fourth order. Added mass and loads
/// use the same L_k: weight and buoyancy are proportional to the mass they act on, and nothing
/// falls askew.
struct Rod {
  std::string name;
  Pose mount;                           ///< base frame in the root frame
  std::vector<double> x_m;              ///< arc length of nodes
  std::vector<RodElement> elements;     ///< N, from the base
  std::vector<RodNode> nodes, middles;  ///< at nodes, and inside elements
  std::vector<Pose> reference;          ///< nodal poses at rest, in the base frame
  std::vector<SectionLoad> loads;       ///< of the effects, on every node
  /// A distributed wrench of the scene.
  struct Distributed {
    std::string name;
    DistributedLoad load;
    Schedule schedule;
    int power_place{-1};
  };
  std::vector<Distributed> distributed;
  std::vector<RodPoint> points;
  std::vector<RodCable> cables;
  std::vector<RodMuscle> muscles;
  std::vector<RodPayload> payloads;
  /// Off-diagonal stiffness per element; empty where the strains do not couple.
  std::vector<Matrix6> coupling;

  int element_count() const { return static_cast<int>(elements.size()); }
};

/// Place of the mass inside an element whose nodes have the poses g1 and g2, with its section's
/// orientation; and its twist (or rate of the twist, less MiddleBias) from those of the nodes.
inline Pose MiddlePose(const RodNode& middle, const RodMiddle& m, const Pose& g1) {
  Pose g = g1 * m.half;
  g.position += g.rotation * Vector3(middle.ahead_m, 0, 0);
  return g;
}
inline Vector6 MiddleTwist(const RodNode& middle, const RodMiddle& m, const Vector6& eta1,
                           const Vector6& eta2) {
  return TwistAhead(middle.ahead_m, MiddleTwist(m, eta1, eta2));
}
inline void AddMiddleWrench(const RodNode& middle, const RodMiddle& m, const Vector6& w,
                            Vector6* f1, Vector6* f2) {
  AddMiddleWrench(m, WrenchFromAhead(middle.ahead_m, w), f1, f2);
}

/// What coupled strains and muscles add to RodStress of element `i`; `muscles` holds one moment per
/// element, or none.
inline void AddCoupledStress(const Rod& rod, int i, const RodElementState& s,
                             const std::vector<Vector3>& muscles, Vector6* sigma) {
  if (!rod.coupling.empty()) {
    const RodElement& e = rod.elements[i];
    *sigma += rod.coupling[i] * (s.Strain(e) - e.reference_strain);
  }
  if (!muscles.empty()) sigma->head<3>() -= muscles[i];
}

/// Throws BadRobot.
Rod MakeRod(const Arm& arm, const Water& water, const Effects& effects);

/// Length of the cable across an element of strain xi, and its derivative in d = l xi (a stress:
/// share [offset x t; t], t the unit tangent of the path). `tangent`, where not null, receives the
/// second derivative (6x6).
double CablePieceLength(const CablePiece& piece, const RodElement& e, const Vector6& d,
                        Vector6* gradient, Matrix6* hessian);

}  // namespace mantle::model
