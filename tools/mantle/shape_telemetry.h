#pragma once

#include <cstddef>
#include <vector>

#include "model/plant.h"
#include "tools/mantle/telemetry.h"

/// The whole bodies as messages MANTLE_SHAPE (docs/telemetry.md): poses of the arms' nodes, the
/// mantle's meridian, strains and what the material holds between nodes, and where cables run.
///
///   strain xi = log(g1^-1 g2) / l, stress sigma = Sigma (xi - xi*) + Upsilon xi_dot (model/
///   rod_element.h); mantle: strains and their conjugates per unit area (model/shell_element.h)
///
/// A span that holds several elements has their means, weighted by length.

namespace mantle::tools {

class ShapeMessages {
 public:
  /// `plant` must outlive it. A robot whose nodes do not fit into one message is thinned: every
  /// k-th node of each body is kept, and its last. Throws BadInput where not even two nodes for
  /// each body fit.
  explicit ShapeMessages(const model::Plant& plant);

  /// Of a state of the plant, or of one lifted from the reduced model; tensions in the order of
  /// Sample::cable_tension_n [N], 0 where there are none. Poses are the earth's, a current's drift
  /// added. Throws std::logic_error where the state's elements turn too far to have a strain, which
  /// no step leaves.
  const ShapeTelemetry& Of(const model::PlantState& state, const std::vector<double>& tension_n);

  /// Elements in a span; 1: every node is kept.
  int thinning() const { return thinning_; }

 private:
  void AddArm(int arm, const model::PlantState& state);
  void AddMantle(const model::PlantState& state);
  void AddCables(const model::PlantState& state, const std::vector<double>& tension_n);
  std::size_t EncodedBytes() const;

  const model::Plant& plant_;
  int thinning_{1};
  model::Vector3 drift_m_{model::Vector3::Zero()};
  ShapeTelemetry message_;
};

}  // namespace mantle::tools
