// A controller of one's own in the closed loop of a scene, found by its name: it holds the tensions
// that a proportional law on the tip's place gives.
//
// Components: loop
// Run: own_controller SCENES/reach.toml
// Prints: ^mine: mean error [0-9.]+ mm over 3\.0 s

#include <algorithm>
#include <cstdio>
#include <memory>

#include "controller/registry.h"
#include "controller/steering.h"
#include "loop/closed_loop.h"

namespace {

using namespace mantle::controller;

class TipSpring final : public Controller {
 public:
  explicit TipSpring(const ControllerParts& parts)
      : directions_(PullDirections(parts.model, parts.reference.arm())),
        aim_(parts.model, parts.reference) {}

  void Command(double, const ReducedState* estimate, Eigen::Ref<VectorX> tensions) override {
    tensions.setConstant(kBias_n);
    if (estimate == nullptr) return;
    const SteeringError away = aim_.At(*estimate, 0.0);
    AddPull(directions_, kStiffness_n_m * away.error + kDamping_n_s_m * away.rate, tensions);
  }

 private:
  static constexpr double kBias_n = 0.02, kStiffness_n_m = 4.0, kDamping_n_s_m = 0.3;
  Eigen::Matrix2Xd directions_;
  Aim aim_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "own_controller SCENE\n"), 2;
  RegisterController(
      {"mine", [](const ControllerParts& parts) { return std::make_unique<TipSpring>(parts); }});
  try {
    const auto scene =
        mantle::scene::LoadScene(argv[1], {"control.controller=\"mine\"", "time.duration=3"});
    const mantle::loop::LoopResult result = mantle::loop::ClosedLoop(scene).Run();
    std::printf("mine: mean error %.1f mm over %.1f s\n", 1e3 * result.mean_error, result.time_s);
    return result.ok ? 0 : 3;
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 2;
  }
}
