#include <gtest/gtest.h>

#include <cmath>

#include "loop/scene/toml_document.h"

namespace mantle::scene {
namespace {

bool Same(const TomlValue& a, const TomlValue& b) {
  if (a.kind != b.kind || a.boolean != b.boolean || a.number != b.number || a.text != b.text ||
      a.items.size() != b.items.size()) {
    return false;
  }
  for (std::size_t i = 0; i < a.items.size(); ++i) {
    const TomlValue* other = a.keys.empty() ? &b.items[i] : b.Find(a.keys[i]);
    if (other == nullptr || !Same(a.items[i], *other)) return false;
  }
  return true;
}

constexpr const char* kDocument = R"(
title = "a \"quoted\" text, a tab\tand \\"
"my key" = 1
empty = {}
whole = -3
number = 2.0
mixed = [1, 2.5, "3 mm", [true, false]]
[table]
long = { one = "a text that does not fit", two = "on a line with the others", three = "of this table" }
[table."odd.name"]
x = 1e-300
[[arms]]
name = "left"
cables = [{ name = "a", tension = { type = "triangular", low = 0.25, high = 1, period = 0.66, start = 0.125 } }, { name = "b", tension = 0 }]
[[arms]]
name = "right"
mount = { axis = [0, 0, -1] }
points = []
)";

TEST(TomlWriter, WhatIsWrittenReadsBackTheSame) {
  const TomlValue document = ParseToml(kDocument, "s.toml");
  const std::string text = WriteToml(document);
  EXPECT_TRUE(Same(document, ParseToml(text, "written.toml"))) << text;
}

TEST(TomlWriter, NumbersKeepEveryBit) {
  for (const double x : {0.1, 1.0 / 3, 1e22, -5e-324, 1.7976931348623157e308, 4.0, -0.0}) {
    TomlValue document;
    document.Set("x", TomlNumber(x));
    const TomlValue back = ParseToml(WriteToml(document), "s.toml");
    EXPECT_EQ(back.Find("x")->kind, TomlValue::Kind::kNumber);
    EXPECT_EQ(back.Find("x")->number, x);
    EXPECT_EQ(std::signbit(back.Find("x")->number), std::signbit(x));
  }
}

}  // namespace
}  // namespace mantle::scene
