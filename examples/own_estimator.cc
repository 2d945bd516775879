// An estimator of one's own in the closed loop of a scene with noise, found by its name: it follows
// the measurements with a constant gain (an alpha filter of poses, strains and rates).
//
// Components: loop
// Run: own_estimator SCENES/reach_noise.toml
// Prints: ^mine: worst strain error [0-9.]+ of the sensors' [0-9.]+ 1/m

#include <algorithm>
#include <cstdio>
#include <memory>

#include "controller/registry.h"
#include "loop/closed_loop.h"
#include "reduced/outputs.h"

namespace {

using namespace mantle::controller;

class Follower final : public Estimator {
 public:
  explicit Follower(const EstimatorParts& parts)
      : state_(InitialState(parts.model)),
        none_(parts.model.input_count()),
        change_(2 * parts.model.velocity_count()) {}

  void Start(const ReducedState& state) override { state_ = state; }
  void Update(double t_s, const Eigen::Ref<const VectorX>&, const ReducedState* measured) override {
    if (measured != nullptr && measured->q.allFinite() && measured->v.allFinite()) {
      StateDifference(state_, *measured, change_);
      change_ *= kGain;
      const ReducedState before = state_;
      mantle::reduced::MoveState(before, change_, &state_);
    }
    state_.time_s = t_s;
  }
  const ReducedState& state() const override { return state_; }
  const Disturbance& disturbance() const override { return none_; }

 private:
  static constexpr double kGain = 0.3;
  ReducedState state_;
  Disturbance none_;
  VectorX change_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "own_estimator SCENE\n"), 2;
  RegisterEstimator(
      {"mine", [](const EstimatorParts& parts) { return std::make_unique<Follower>(parts); }});
  try {
    const auto scene = mantle::scene::LoadScene(
        argv[1],
        {"control.estimator.type=\"mine\"", "control.controller=\"pid\"", "time.duration=2"});
    mantle::loop::ClosedLoop loop(scene);
    double worst = 0;
    const auto result = loop.Run([&](const mantle::loop::LoopStep& step) {
      worst = std::max(worst, (step.estimate.q - step.truth.q).cwiseAbs().maxCoeff());
      return true;
    });
    std::printf("mine: worst strain error %.3f of the sensors' %.3f 1/m\n", worst,
                scene.sensors.strain);
    return result.ok ? 0 : 3;
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 2;
  }
}
