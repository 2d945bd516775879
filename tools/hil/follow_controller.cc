#include "tools/hil/follow_controller.h"

#include <memory>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::tools {
namespace {

class FollowController final : public controller::Controller {
 public:
  FollowController(const controller::ControllerParts& parts,
                   controller::Exchange<FollowCommand>& commands)
      : parts_(parts), commands_(commands) {}

  void Command(double, const controller::ReducedState*,
               Eigen::Ref<controller::VectorX> tensions) override {
    commands_.Take();
    const FollowCommand& command = commands_.current();
    const double age_s =
        1e-6 * static_cast<double>(firmware_sim::MonotonicTime_us() - command.came_us);
    if (command.tension_n.size() == tensions.size() && age_s <= command.time_out_s) {
      tensions = command.tension_n;
      return;
    }
    for (Eigen::Index i = 0; i < tensions.size(); ++i) {
      tensions(i) = parts_.options.motors[static_cast<std::size_t>(i)].min_tension_n;
    }
  }

 private:
  controller::ControllerParts parts_;
  controller::Exchange<FollowCommand>& commands_;
};

}  // namespace

void RegisterFollowController(controller::Exchange<FollowCommand>& commands) {
  controller::RegisterController({kFollow,
                                  [&commands](const controller::ControllerParts& parts) {
                                    return std::make_unique<FollowController>(parts, commands);
                                  },
                                  false});
}

}  // namespace mantle::tools
