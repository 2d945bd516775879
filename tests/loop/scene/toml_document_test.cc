#include "loop/scene/toml_document.h"

#include <gtest/gtest.h>

namespace mantle::scene {
namespace {

constexpr const char* kText = R"(
title = "x"
[time]
step = 0.01
[[arms]]
name = "left"
radius = [1, 2]
[[arms]]
name = "right"
)";

std::string OverrideError(const std::string& text) {
  TomlValue document = ParseToml(kText, "s.toml");
  try {
    ApplyOverride(text, &document);
  } catch (const BadScene& error) {
    return error.what();
  }
  return "";
}

TEST(TomlDocument, SyntaxErrorsNameFileAndLine) {
  try {
    ParseToml("a = 1\nb = = 2\n", "s.toml");
    FAIL() << "was accepted";
  } catch (const BadScene& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.rfind("s.toml: line 2, column ", 0), 0u) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
}

TEST(TomlDocument, OverridesReplaceValuesByPathIndexAndName) {
  TomlValue document = ParseToml(kText, "s.toml");
  ApplyOverride("time.step=0.5", &document);
  ApplyOverride("arms[0].radius[1]=7", &document);
  ApplyOverride("arms.right.length=40 cm", &document);
  ApplyOverride("arms.1.elements=3", &document);
  EXPECT_EQ(document.Find("time")->Find("step")->number, 0.5);
  const TomlValue& arms = *document.Find("arms");
  EXPECT_EQ(arms.items[0].Find("radius")->items[1].number, 7);
  EXPECT_EQ(arms.items[1].Find("length")->text, "40 cm");
  EXPECT_EQ(arms.items[1].Find("elements")->number, 3);
  EXPECT_EQ(arms.items[1].Find("elements")->kind, TomlValue::Kind::kInteger);
}

TEST(TomlDocument, OverridesMakeMissingTables) {
  TomlValue document = ParseToml(kText, "s.toml");
  ApplyOverride("effects.jet_thrust.flux=\"radial\"", &document);
  EXPECT_EQ(document.Find("effects")->Find("jet_thrust")->Find("flux")->text, "radial");
}

TEST(TomlDocument, BadOverridesSayWhatTheyAre) {
  EXPECT_EQ(OverrideError("time.step"),
            "--set time.step: must be key=value, such as time.step=0.005");
  EXPECT_EQ(OverrideError("arms[2].length=1"), "--set arms[2].length=1: index 2: must be < 2");
  EXPECT_EQ(OverrideError("arms.middle.length=1"),
            "--set arms.middle.length=1: no element is named \"middle\"");
  EXPECT_EQ(OverrideError("time..step=1"), "--set time..step=1: the path has an empty part");
}

}  // namespace
}  // namespace mantle::scene
