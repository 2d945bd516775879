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

std::string ParseError(const std::string& text) {
  try {
    ParseToml(text, "s.toml");
  } catch (const BadScene& error) {
    return error.what();
  }
  return "";
}

std::string Deep(int parts) {
  std::string key = "a";
  for (int i = 1; i < parts; ++i) key += ".a";
  return key;
}

TEST(TomlDocument, KeysHaveABoundedDepth) {
  EXPECT_EQ(ParseError(Deep(kMaxKeyParts) + " = 1\n"), "");
  EXPECT_EQ(ParseError(Deep(50000) + " = 1\n"), "s.toml: a key has 50000 parts, must be <= 32");
  EXPECT_EQ(ParseError("[" + Deep(50000) + "]\n"), "s.toml: a key has 50000 parts, must be <= 32");
  EXPECT_EQ(ParseError("x = { " + Deep(50000) + " = 1 }\n"),
            "s.toml: a key has 50000 parts, must be <= 32");
  const std::string dots(1000, '.');
  EXPECT_EQ(ParseError("x = \"" + dots + "\" # " + dots + "\n"), "") << "texts and comments";
  EXPECT_EQ(ParseError("x = \"\"\"\n" + dots + "\\\"" + dots + "\"\"\"\n"), "");
  const std::string refusal = OverrideError(Deep(50000) + "=1");
  EXPECT_NE(refusal.find("a key has 50000 parts, must be <= 32"), std::string::npos) << refusal;
  EXPECT_LT(refusal.size(), 250u) << "the key is cut short";
}

TEST(TomlDocument, TextsAreUtf8) {
  EXPECT_EQ(ParseError("x = \"\xe2\x82\xac\"\n"), "");
  EXPECT_EQ(ParseError("x = \"\xff\"\n"), "s.toml: is not UTF-8 text");
  EXPECT_EQ(ParseError("# \xff\n"), "s.toml: is not UTF-8 text");
  EXPECT_EQ(OverrideError("title=\xff"), "--set title=\\xff: is not UTF-8 text");
}

}  // namespace
}  // namespace mantle::scene
