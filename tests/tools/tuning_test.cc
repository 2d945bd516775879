#include "tools/studies/tuning.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/paths.h"

// What is tuned of which baseline: every gain that acts on the goal, and none that does not.

namespace mantle::tools {
namespace {

using controller::CircleTask;
using controller::ControlGoal;
using controller::ControllerKind;
using controller::CruiseTask;
using controller::PathTask;

std::string Keys(ControllerKind kind, const ControlGoal& goal) {
  std::string keys;
  for (const TunedParameter& p : TunedParameters(kind, goal)) {
    EXPECT_LT(p.low, p.high) << p.key;
    EXPECT_TRUE(!p.logarithmic || p.low > 0.0) << p.key;
    keys += (keys.empty() ? "" : " ") + std::string(p.key);
  }
  return keys;
}

TEST(TunedParameters, AreThoseThatActOnTheGoal) {
  EXPECT_EQ(Keys(ControllerKind::kGait, PathTask{}), "gait_scale gait_period");
  EXPECT_EQ(Keys(ControllerKind::kPursuit, PathTask{}),
            "gait_scale speed_gain proportional derivative lookahead");
  EXPECT_EQ(Keys(ControllerKind::kPid, PathTask{}),
            "gait_scale speed_gain proportional derivative integral lookahead");
  EXPECT_EQ(Keys(ControllerKind::kLqr, PathTask{}),
            "gait_scale gait_period speed_gain effort lookahead");
  EXPECT_EQ(Keys(ControllerKind::kPid, CruiseTask{}),
            "gait_scale gait_period speed_gain proportional derivative integral");
  EXPECT_EQ(Keys(ControllerKind::kGait, CircleTask{}), "gait_scale gait_lead");
  EXPECT_EQ(Keys(ControllerKind::kPid, CircleTask{}),
            "gait_scale gait_lead proportional derivative integral lookahead");
}

TEST(TunedParameters, EveryGainOfABaselineIsItsOwn) {
  for (const ControllerKind kind :
       {ControllerKind::kPursuit, ControllerKind::kPid, ControllerKind::kLqr}) {
    for (const ControlGoal& goal : {ControlGoal(PathTask{}), ControlGoal(CircleTask{})}) {
      controller::BaselineGains gains;
      double value = 1.0;
      const auto parameters = TunedParameters(kind, goal);
      for (const TunedParameter& p : parameters) gains.*p.value = value++;
      value = 1.0;
      for (const TunedParameter& p : parameters) EXPECT_EQ(gains.*p.value, value++) << p.key;
    }
  }
}

TEST(TuningToml, GivesWhatWasSearchedAndWhatElseIsNotTheDefault) {
  const scene::Scene scene = scene::LoadScene(tests::SourcePath("scenes/steer.toml"), {});
  Tuning tuning{};
  tuning.kind = ControllerKind::kPid;
  tuning.gains = {};
  const std::string by_default = TuningToml(tuning, scene);
  for (const char* key : {"gait_scale", "speed_gain", "proportional", "integral", "lookahead"}) {
    EXPECT_NE(by_default.find(std::string("\n") + key + " = "), std::string::npos) << by_default;
  }
  EXPECT_EQ(by_default.find("effort"), std::string::npos) << "of another baseline";
  EXPECT_EQ(by_default.find("gait_lead"), std::string::npos) << "of another goal";
  tuning.gains.gait_lead_s = 0.125;
  EXPECT_NE(TuningToml(tuning, scene).find("\ngait_lead = 0.125\n"), std::string::npos);
}

}  // namespace
}  // namespace mantle::tools
