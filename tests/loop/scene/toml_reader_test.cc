#include "loop/scene/toml_reader.h"

#include <gtest/gtest.h>

#include <functional>

namespace mantle::scene {
namespace {

// Message of what `read` throws on a document with the one key x.
std::string Message(const std::string& toml, const std::function<void(TomlReader*)>& read) {
  const TomlValue document = ParseToml(toml, "s.toml");
  SceneContext context{"s.toml", ".", nullptr, {}};
  TomlReader reader(document, "", "", &context);
  try {
    read(&reader);
    reader.Finish();
  } catch (const BadScene& error) {
    return error.what();
  }
  return "";
}

std::string NumberMessage(const std::string& value) {
  return Message("x = " + value,
                 [](TomlReader* r) { r->Number("x", Quantity::kLength, kPositive); });
}

TEST(TomlReader, NumbersOutOfBoundNameValueUnitAndBound) {
  EXPECT_EQ(NumberMessage("2"), "");
  EXPECT_EQ(NumberMessage("\"2 mm\""), "");
  EXPECT_EQ(NumberMessage("-0.006"), "s.toml: x: -0.006 m: must be > 0");
  EXPECT_EQ(NumberMessage("\"-6 mm\""), "s.toml: x: -0.006 m: must be > 0");
  EXPECT_EQ(NumberMessage("0"), "s.toml: x: 0 m: must be > 0");
  EXPECT_EQ(NumberMessage("nan"), "s.toml: x: nan m: must be finite and > 0");
  EXPECT_EQ(NumberMessage("inf"), "s.toml: x: inf m: must be finite and > 0");
  EXPECT_EQ(NumberMessage("\"1e400 m\"").rfind("s.toml: x: ", 0), 0u);
}

TEST(TomlReader, WrongTypesAndUnitsNameWhatIsWanted) {
  const std::string wanted = "must be a number > 0 with unit m, mm, cm (a bare number is SI)";
  EXPECT_EQ(NumberMessage("true"), "s.toml: x: true: " + wanted);
  EXPECT_EQ(NumberMessage("\"2 kPa\""), "s.toml: x: \"2 kPa\": " + wanted);
  EXPECT_EQ(NumberMessage("[1, 2]"), "s.toml: x: [1, 2]: " + wanted);
  EXPECT_EQ(NumberMessage("1979-05-27"), "s.toml: x: a date or time: " + wanted);
  EXPECT_EQ(Message("", [](TomlReader* r) { r->Number("x", Quantity::kLength, kPositive); }),
            "s.toml: x: is missing: " + wanted);
}

TEST(TomlReader, ArraysNameTheEntry) {
  const auto read = [](TomlReader* r) { r->Numbers("x", Quantity::kLength, kPositive, 2); };
  EXPECT_EQ(Message("x = [1, \"2 mm\"]", read), "");
  EXPECT_EQ(Message("x = [1, -2]", read), "s.toml: x[1]: -2 m: must be > 0");
  EXPECT_EQ(Message("x = [1, 2, 3]", read), "s.toml: x: [1, 2, 3]: must be an array of 2 numbers");
  EXPECT_EQ(Message("x = 1", read), "s.toml: x: 1: must be an array of 2 numbers");
}

TEST(TomlReader, WholeNumbersAreWhole) {
  const auto read = [](TomlReader* r) { r->Integer("x", 1, 9, 5); };
  EXPECT_EQ(Message("x = 3", read), "");
  EXPECT_EQ(Message("x = 3.0", read), "s.toml: x: 3: must be a whole number in [1, 9]");
  EXPECT_EQ(Message("x = 10", read), "s.toml: x: 10: must be a whole number in [1, 9]");
}

TEST(TomlReader, ChoicesListTheNames) {
  const auto read = [](TomlReader* r) { r->Choice<int>("x", {{"one", 1}, {"two", 2}}, 1); };
  EXPECT_EQ(Message("x = \"two\"", read), "");
  EXPECT_EQ(Message("x = \"three\"", read),
            "s.toml: x: \"three\": must be one of \"one\", \"two\"");
  EXPECT_EQ(Message("x = 1", read), "s.toml: x: 1: must be one of \"one\", \"two\"");
}

TEST(TomlReader, UnknownKeysSuggestTheNearest) {
  const auto read = [](TomlReader* r) {
    r->Number("radius", Quantity::kLength, kPositive, 1.0);
    r->Boolean("weight", false);
  };
  EXPECT_EQ(Message("raduis = 1", read), "s.toml: raduis: unknown key, did you mean \"radius\"?");
  EXPECT_EQ(Message("colour = 1", read),
            "s.toml: colour: unknown key, must be one of radius, weight");
}

}  // namespace
}  // namespace mantle::scene
