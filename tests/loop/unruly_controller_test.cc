#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "controller/registry.h"
#include "loop/closed_loop.h"
#include "loop/scene/scene.h"
#include "tests/support/paths.h"

// Whatever a controller commands, the motors get tensions that are finite and within their limits.

namespace mantle::loop {
namespace {

constexpr double kRoundOff_n = 1e-12;
constexpr double kBegin_s = 0.2;

/// 0.1 N of every motor, then the odd value.
class Odd final : public controller::Controller {
 public:
  explicit Odd(double value) : value_(value) {}
  void Command(double t_s, const reduced::ReducedState*,
               Eigen::Ref<model::VectorX> tensions) override {
    tensions.setConstant(t_s < kBegin_s ? 0.1 : value_);
  }

 private:
  double value_;
};

struct Case {
  const char* name;
  double value;
  double ends_n;  ///< what is commanded in the end
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class UnrulyController : public testing::TestWithParam<Case> {};

TEST_P(UnrulyController, IsKeptWithinTheMotorsLimits) {
  controller::RegisterController({GetParam().name, [](const controller::ControllerParts&) {
                                    return std::make_unique<Odd>(GetParam().value);
                                  }});
  const scene::Scene scene = scene::LoadScene(
      tests::SourcePath("scenes/reach.toml"),
      {"time.duration=0.8", std::string("control.controller=\"") + GetParam().name + "\""});
  const auto& limits = scene.control->motors;
  const double period_s = scene.drives.period_s;
  ClosedLoop loop(scene);
  model::VectorX last = model::VectorX::Zero(static_cast<Eigen::Index>(limits.size()));
  const LoopResult result = loop.Run([&](const LoopStep& step) {
    for (Eigen::Index i = 0; i < step.command_n.size(); ++i) {
      const auto& limit = limits[static_cast<std::size_t>(i)];
      EXPECT_TRUE(std::isfinite(step.command_n(i))) << step.time_s;
      EXPECT_GE(step.command_n(i), limit.min_tension_n - kRoundOff_n);
      EXPECT_LE(step.command_n(i), limit.max_tension_n + kRoundOff_n);
      EXPECT_LE(std::abs(step.command_n(i) - last(i)), limit.max_rate_n_s * period_s + kRoundOff_n);
    }
    last = step.command_n;
    return true;
  });
  ASSERT_TRUE(result.ok) << result.reason;
  for (const double tension : last) EXPECT_NEAR(tension, GetParam().ends_n, kRoundOff_n);
  // Rates cut the rise to 0.1 N as well; a value that is not finite is replaced before it is
  // limited.
  const bool cut = std::isfinite(GetParam().value);
  EXPECT_EQ(result.limit_touches > 50, cut) << result.limit_touches;
}

INSTANTIATE_TEST_SUITE_P(Values, UnrulyController,
                         testing::Values(Case{"nan", std::numeric_limits<double>::quiet_NaN(), 0.1},
                                         Case{"infinite", std::numeric_limits<double>::infinity(),
                                              0.1},
                                         Case{"huge", 50.0, 1.0}, Case{"pushing", -50.0, 0.0}),
                         [](const auto& info) { return std::string(info.param.name); });

/// Notes what it is told, in order.
class Diary final : public controller::Controller {
 public:
  explicit Diary(std::string* entries) : entries_(*entries) {}
  void Start(const reduced::ReducedState& estimate) override {
    entries_ += estimate.q.allFinite() ? "start " : "start? ";
  }
  void Update(double, const reduced::ReducedState* estimate,
              const Eigen::Ref<const model::VectorX>&, std::int64_t) override {
    entries_ += estimate != nullptr ? "update " : "update? ";
  }
  void Prepare(double, const Eigen::Ref<const model::VectorX>&) override { entries_ += "prepare "; }
  void Command(double, const reduced::ReducedState*, Eigen::Ref<model::VectorX> tensions) override {
    entries_ += "command ";
    tensions.setConstant(0.1);
  }

 private:
  std::string& entries_;
};

// Prepared last before the measurement that the next update takes.
TEST(ControllerInTheLoop, IsStartedOnceThenUpdatedEveryPeriodAndAskedEverySync) {
  std::string entries;
  controller::RegisterController({"diary", [&](const controller::ControllerParts&) {
                                    return std::make_unique<Diary>(&entries);
                                  }});
  const scene::Scene scene =
      scene::LoadScene(tests::SourcePath("scenes/reach.toml"),
                       {"time.duration=0.2", "control.controller=\"diary\""});
  ASSERT_EQ(std::lround(scene.control->period_s / scene.drives.period_s), 5);
  ClosedLoop loop(scene);
  ASSERT_TRUE(loop.Run().ok);
  const std::string period = "update command command command command command prepare ";
  EXPECT_EQ(entries.substr(0, 6 + 2 * period.size()), "start " + period + period);
  EXPECT_EQ(entries.find("start", 1), std::string::npos);
}

}  // namespace
}  // namespace mantle::loop
