#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "model/energy.h"
#include "reduced/build/projection.h"
#include "tests/support/random_values.h"

/// A reduced model with an effect and the same without it, in one moving, deformed state: what the
/// effect adds.

namespace mantle::tests {

class ReducedPair {
 public:
  /// Both have one arm, whose sections are the plant's nodes, so that sums over them agree; of 4, 8,
  /// 12 ... elements, whose nodes are the ends of the basis' four pieces.
  ReducedPair(const model::Robot& with_effect, const model::Robot& without_effect)
      : reduction(OnPlantNodes()),
        with(with_effect, reduction),
        without(without_effect, reduction),
        state(InitialState(with)) {
    RandomValues random(3);
    for (double& q : state.q) q = 0.3 * random.Uniform();
    for (double& v : state.v) v = 0.3 * random.Uniform();
    state.root = random.AnyPose(1);
  }

  /// What the effect adds to the residual.
  model::VectorX Added(const reduced::ReducedState& s) const {
    model::VectorX out[2];
    const reduced::ReducedPlant* models[2] = {&without, &with};
    for (int i = 0; i < 2; ++i) {
      model::PlantInputs inputs;
      EvaluateInputs(*models[i], 0.0, false, &inputs);
      reduced::ReducedWork work(*models[i]);
      const model::VectorX rest = model::VectorX::Zero(with.velocity_count());
      EXPECT_FALSE(EvaluateResidual(*models[i], s, rest, inputs, &work));
      out[i] = work.residual;
    }
    return out[1] - out[0];
  }

  /// Power that the plant accounts under these names, in the same state [W].
  double PlantPower(const std::vector<std::string>& names) const {
    reduced::Projection projection(with);
    model::PlantState full = InitialState(with.plant);
    projection.Lift(state, &full);
    model::PlantInputs inputs;
    EvaluateInputs(with.plant, 0.0, false, &inputs);
    model::PlantWork work(with.plant);
    EXPECT_FALSE(EvaluateForces(with.plant, full, inputs, &work));
    model::EnergyAccount account(with.plant);
    account.EvaluatePowers(with.plant, full, inputs, work,
                           model::VectorX::Zero(with.plant.velocity_size()));
    double power = 0;
    for (const std::string& name : names) {
      const auto at = std::find(account.names().begin(), account.names().end(), name);
      EXPECT_NE(at, account.names().end()) << name;
      if (at != account.names().end()) power += account.power_w()[at - account.names().begin()];
    }
    return power;
  }

  reduced::Reduction reduction;
  reduced::ReducedPlant with, without;
  reduced::ReducedState state;

 private:
  static reduced::Reduction OnPlantNodes() {
    reduced::Reduction r;
    r.arms[0].rule = reduced::SectionRule::kPlantNodes;
    return r;
  }
};

}  // namespace mantle::tests
