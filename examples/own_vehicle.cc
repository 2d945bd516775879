// A vehicle of one's own at the far end of the wire, found by its name: the drives that come along,
// and in place of the full plant the reduced model, which is what the controller believes in.
//
// Components: loop drive ipopt
// Run: own_vehicle SCENES/reach.toml
// Prints: ^mine: mean error [0-9.]+ mm over 3\.0 s

#include <cstdio>
#include <memory>

#include "controller/trajectory.h"
#include "loop/closed_loop.h"
#include "loop/plant_side/drive_rack.h"
#include "loop/vehicle_side.h"
#include "reduced/outputs.h"

namespace {

using namespace mantle;
using loop::Sensors;
using loop::Status;

class ReducedVehicle final : public loop::VehicleSide {
 public:
  explicit ReducedVehicle(const loop::VehicleParts& parts)
      : model_(parts.model),
        propagator_(parts.model, {reduced::StepScheme::kSdirk2, 1e-6}),
        // Drums on springs whose far ends stand still: 10 mm of slack, then what is reeled in
        // pulls.
        rack_(parts.bus, static_cast<int>(parts.motors.size()),
              {0, parts.drives.cable_stiffness_n_m, 0.01, parts.drives.cable_damping_n_s_m}, 0),
        state_(InitialState(parts.model)),
        next_(state_),
        tension_(model::VectorX::Zero(parts.model.input_count())) {}

  void Pump(std::int64_t now_us) override { rack_.Pump(now_us); }
  void Hold(std::int64_t now_us) override { Turn(now_us); }
  void Release(std::int64_t now_us) override { origin_us_ = now_us; }
  Status Advance(std::int64_t now_us) override {
    Turn(now_us);
    const double to_s = 1e-6 * static_cast<double>(now_us - origin_us_);
    if (!propagator_.Step(state_, to_s - state_.time_s, tension_, &next_, nullptr).ok) {
      return {false, "the reduced model could not be stepped"};
    }
    next_.time_s = to_s;
    std::swap(state_, next_);
    return {};
  }
  int coupling_steps() const override { return 10; }
  bool braked() const override { return rack_.braked(); }

  Status Look(double) override { return {}; }
  void Measure(Sensors* message) override {
    message->time_s = state_.time_s;
    message->has_state = true;
    message->state = state_;
    message->cables.resize(static_cast<std::size_t>(tension_.size()));
  }
  const reduced::ReducedState& truth() const override { return state_; }
  const model::VectorX& tension_n() const override { return tension_; }
  model::Vector3 tip(int arm) const override {
    const auto place = EvaluateTip(model_.arms[arm], &state_.q(model_.arm_first(arm)), nullptr);
    return state_.root.position + state_.root.rotation * place.position;
  }
  double cable_work_j(int motor) const override { return rack_[motor].output().cable_work_j; }

 private:
  void Turn(std::int64_t now_us) {
    rack_.AdvanceTo(now_us);
    for (int i = 0; i < rack_.size(); ++i) tension_(i) = rack_[i].output().tension_n;
  }

  const reduced::ReducedModel& model_;
  controller::Propagator propagator_;
  loop::DriveRack rack_;
  reduced::ReducedState state_, next_;
  model::VectorX tension_;
  std::int64_t origin_us_{0};
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "own_vehicle SCENE\n"), 2;
  loop::RegisterVehicle({"mine", [](const loop::VehicleParts& parts) {
                           return std::make_unique<ReducedVehicle>(parts);
                         }});
  try {
    const auto scene = scene::LoadScene(argv[1], {"drives.vehicle=\"mine\"", "time.duration=3"});
    const loop::LoopResult result = loop::ClosedLoop(scene).Run();
    std::printf("mine: mean error %.1f mm over %.1f s\n", 1e3 * result.mean_error, result.time_s);
    if (!result.ok) std::fprintf(stderr, "%s\n", result.reason.c_str());
    return result.ok ? 0 : 3;
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 2;
  }
}
