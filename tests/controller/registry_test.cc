#include "controller/registry.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "loop/scene/scene.h"
#include "reduced/reduction_schema.h"
#include "tests/controller/control_scene.h"
#include "tests/support/paths.h"
#include "tests/support/refusal.h"

namespace mantle::controller {
namespace {

using tests::ControlScene;
using tests::Refusal;

class Constant final : public Controller {
 public:
  void Command(double, const ReducedState*, Eigen::Ref<VectorX> tensions) override {
    tensions.setConstant(0.125);
  }
};

const std::string kSteer = tests::SourcePath("scenes/steer.toml");

TEST(Registry, KnowsWhatComesAlong) {
  const std::vector<std::string> controllers = {"mpc", "gait", "pursuit", "pid", "lqr"};
  EXPECT_EQ(ControllerNames(), controllers);
  EXPECT_EQ(EstimatorNames(), std::vector<std::string>{"model"});
  EXPECT_TRUE(FindController("mpc").uses_disturbance);
  EXPECT_TRUE(FindController("lqr").uses_disturbance);
  EXPECT_FALSE(FindController("gait").uses_disturbance);
}

TEST(Registry, AnUnknownNameIsRefusedAndTheKnownOnesListed) {
  EXPECT_EQ(Refusal([] { FindController("mine"); }),
            "no controller is called \"mine\"; known: mpc, gait, pursuit, pid, lqr");
  EXPECT_EQ(Refusal([] { FindEstimator("mine"); }),
            "no estimator is called \"mine\"; known: model");
  const std::string scene =
      Refusal([] { scene::LoadScene(kSteer, {"control.controller=\"mine\""}); });
  EXPECT_NE(scene.find("control.controller"), std::string::npos) << scene;
  EXPECT_NE(scene.find("must be one of \"mpc\", \"gait\""), std::string::npos) << scene;
  const std::string estimator =
      Refusal([] { scene::LoadScene(kSteer, {"control.estimator.type=\"mine\""}); });
  EXPECT_NE(estimator.find("control.estimator.type"), std::string::npos) << estimator;
}

TEST(Registry, RefusesNamesThatAreNoneOrTaken) {
  const auto make = [](const ControllerParts&) { return std::make_unique<Constant>(); };
  EXPECT_NE(Refusal([&] { RegisterController({"", make}); }).find("a name has"), std::string::npos);
  EXPECT_NE(Refusal([&] {
              RegisterController({"my own", make});
            }).find("a name has"),
            std::string::npos);
  EXPECT_NE(Refusal([&] { RegisterController({"pid", make}); }).find("taken"), std::string::npos);
  EXPECT_NE(Refusal([&] {
              RegisterController({"empty", nullptr});
            }).find("nothing makes it"),
            std::string::npos);
  EXPECT_THROW(RegisterEstimator({"model", nullptr}), std::invalid_argument);
}

TEST(Registry, ASceneFindsAControllerOfAUsersOwnByItsName) {
  RegisterController(
      {"constant", [](const ControllerParts&) { return std::make_unique<Constant>(); }});
  ControlScene world("steer.toml");
  world.scene = scene::LoadScene(kSteer, {"control.controller=\"constant\""});
  ASSERT_EQ(world.scene.control->controller, "constant");
  const Reference reference(world.scene.control->goal, world.scene.robot);
  const auto controller =
      MakeController({world.model, world.step, *world.scene.control, reference});
  VectorX tensions = VectorX::Zero(world.model.input_count());
  controller->Start(world.Start());
  controller->Command(0.0, nullptr, tensions);
  EXPECT_EQ(tensions.minCoeff(), 0.125);
}

TEST(Registry, MotorsAreFoundByName) {
  ControlScene world("steer.toml");
  const auto& motors = world.scene.reduction.actuators;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    EXPECT_EQ(FindMotor(motors, motors[i].name), static_cast<int>(i));
  }
  const std::string refusal = Refusal([&] { FindMotor(motors, "tail"); });
  EXPECT_NE(refusal.find("no motor is called \"tail\"; known: " + motors[0].name),
            std::string::npos)
      << refusal;
}

TEST(Registry, CablesAreFoundByName) {
  ControlScene world("steer.toml");
  const auto cables = reduced::CableActuators(world.scene.robot);
  ASSERT_GT(cables.size(), 3u);
  for (std::size_t i = 0; i < cables.size(); ++i) {
    EXPECT_EQ(reduced::FindCable(world.scene.robot, cables[i].name), static_cast<int>(i));
  }
  const std::string refusal = Refusal([&] { reduced::FindCable(world.scene.robot, "tail"); });
  EXPECT_NE(refusal.find("no cable is called \"tail\"; known: " + cables[0].name),
            std::string::npos)
      << refusal;
}

}  // namespace
}  // namespace mantle::controller
