#include "loop/scene/toml_reader.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

namespace mantle::scene {
namespace {

using schema::kAnyValue;
using schema::kPositive;
using schema::Optional;
using schema::Required;
using schema::Visitor;

/// What reading a document gave: the message it was refused with, or the document with defaults.
struct Outcome {
  std::string message, filled;
};

Outcome Read(const std::string& toml, const std::function<void(Visitor&)>& visit) {
  const TomlValue document = ParseToml(toml, "s.toml");
  SceneContext context{"s.toml", ".", &document, {}};
  TomlValue filled;
  TomlReader reader(document, "", &context, &filled);
  try {
    visit(reader);
    reader.Finish();
  } catch (const BadScene& error) {
    return {error.what(), ""};
  }
  return {"", WriteToml(filled)};
}

std::string Message(const std::string& toml, const std::function<void(Visitor&)>& visit) {
  return Read(toml, visit).message;
}

std::string NumberMessage(const std::string& value) {
  return Message("x = " + value, [](Visitor& v) {
    double x = 0;
    v.Number(Required({"x"}), Quantity::kLength, kPositive, &x);
  });
}

TEST(TomlReader, NumbersOutOfBoundNameValueUnitAndBound) {
  EXPECT_EQ(NumberMessage("2"), "");
  EXPECT_EQ(NumberMessage("\"2 mm\""), "");
  EXPECT_EQ(NumberMessage("-0.006"), "s.toml: x: -0.006 m: must be > 0");
  EXPECT_EQ(NumberMessage("\"-6 mm\""), "s.toml: x: -0.006 m: must be > 0");
  EXPECT_EQ(NumberMessage("0"), "s.toml: x: 0 m: must be > 0");
  EXPECT_EQ(NumberMessage("nan"), "s.toml: x: nan m: must be finite and > 0");
  EXPECT_EQ(NumberMessage("\"nan m\""), "s.toml: x: nan m: must be finite and > 0");
  EXPECT_EQ(NumberMessage("inf"), "s.toml: x: inf m: must be finite and > 0");
  EXPECT_EQ(NumberMessage("\"1e400 m\"").rfind("s.toml: x: ", 0), 0u);
}

TEST(TomlReader, WrongTypesAndUnitsNameWhatIsNeeded) {
  const std::string needed = "must be a number > 0 with unit m, mm, cm (a bare number is SI)";
  EXPECT_EQ(NumberMessage("true"), "s.toml: x: true: " + needed);
  EXPECT_EQ(NumberMessage("\"2 kPa\""), "s.toml: x: \"2 kPa\": " + needed);
  EXPECT_EQ(NumberMessage("[1, 2]"), "s.toml: x: [1, 2]: " + needed);
  EXPECT_EQ(NumberMessage("1979-05-27"), "s.toml: x: a date or time: " + needed);
  EXPECT_EQ(Message("",
                    [](Visitor& v) {
                      double x = 0;
                      v.Number(Required({"x"}), Quantity::kLength, kPositive, &x);
                    }),
            "s.toml: x: is missing: " + needed);
}

TEST(TomlReader, ArraysNameTheEntry) {
  const auto read = [](Visitor& v) {
    std::vector<double> x;
    v.Numbers({"x"}, Quantity::kLength, kPositive, 2, &x);
  };
  EXPECT_EQ(Message("x = [1, \"2 mm\"]", read), "");
  EXPECT_EQ(Message("x = [1, -2]", read), "s.toml: x[1]: -2 m: must be > 0");
  EXPECT_EQ(Message("x = [1, 2, 3]", read), "s.toml: x: [1, 2, 3]: must be an array of 2 numbers");
  EXPECT_EQ(Message("x = 1", read), "s.toml: x: 1: must be an array of 2 numbers");
}

TEST(TomlReader, WholeNumbersAreWhole) {
  const auto read = [](Visitor& v) {
    int x = 5;
    v.Integer({"x"}, 1, 9, &x);
  };
  EXPECT_EQ(Message("x = 3", read), "");
  EXPECT_EQ(Message("x = 3.0", read), "s.toml: x: 3: must be a whole number in [1, 9]");
  EXPECT_EQ(Message("x = 10", read), "s.toml: x: 10: must be a whole number in [1, 9]");
}

TEST(TomlReader, ChoicesListTheNames) {
  const auto read = [](Visitor& v) {
    int x = 1;
    v.Choice<int>({"x"}, {{"one", 1}, {"two", 2}}, &x);
  };
  EXPECT_EQ(Message("x = \"two\"", read), "");
  EXPECT_EQ(Message("x = \"three\"", read),
            "s.toml: x: \"three\": must be one of \"one\", \"two\"");
  EXPECT_EQ(Message("x = 1", read), "s.toml: x: 1: must be one of \"one\", \"two\"");
}

TEST(TomlReader, ReferencesListWhatIsThere) {
  const auto read = [](const std::vector<std::string>& names) {
    return [names](Visitor& v) {
      int index = -1;
      v.Reference({"arm"}, names, &index);
    };
  };
  EXPECT_EQ(Message("arm = \"left\"", read({"left", "right"})), "");
  EXPECT_EQ(Message("arm = \"up\"", read({"left", "right"})),
            "s.toml: arm: \"up\": must be one of: left, right");
  EXPECT_EQ(Message("", read({})), "s.toml: arm: is missing: must be one of: none in this scene");
}

TEST(TomlReader, KeysThatExcludeEachOtherAreOne) {
  const auto read = [](bool none) {
    return [none](Visitor& v) {
      double a = 0, b = 0;
      v.OneOf("a cable", none,
              {{"a", [&] { v.Number({"a"}, Quantity::kNumber, kAnyValue, &a); }},
               {"b", [&] { v.Number({"b"}, Quantity::kNumber, kAnyValue, &b); }}});
    };
  };
  EXPECT_EQ(Message("a = 1", read(false)), "");
  EXPECT_EQ(Message("b = 1", read(false)), "");
  EXPECT_EQ(Message("a = 1\nb = 2", read(false)),
            "s.toml: b: 2: a cable must have exactly one of `a` and `b`");
  EXPECT_EQ(Message("", read(false)), "s.toml: a: a cable must have exactly one of `a` and `b`");
  EXPECT_EQ(Message("", read(true)), "");
  EXPECT_EQ(Message("a = 1\nb = 2", read(true)),
            "s.toml: b: 2: only one of `a` and `b` may be given");
}

TEST(TomlReader, UnknownKeysSuggestTheNearest) {
  const auto read = [](Visitor& v) {
    double radius = 1;
    bool weight = false;
    v.Number({"radius"}, Quantity::kLength, kPositive, &radius);
    v.Boolean({"weight"}, &weight);
  };
  EXPECT_EQ(Message("raduis = 1", read), "s.toml: raduis: unknown key, did you mean \"radius\"?");
  EXPECT_EQ(Message("radi = 1", read), "s.toml: radi: unknown key, did you mean \"radius\"?");
  EXPECT_EQ(Message("rad = 1", read), "s.toml: rad: unknown key, must be one of radius, weight");
  EXPECT_EQ(Message("colour = 1", read),
            "s.toml: colour: unknown key, must be one of radius, weight");
}

TEST(TomlReader, FilledTablesSpellDefaultsOutAndKeepWhatWasWritten) {
  const auto read = [](Visitor& v) {
    double length = 1, speed = 2, none = 0;
    bool on = true;
    v.Number({"length"}, Quantity::kLength, kPositive, &length);
    v.Number({"speed"}, Quantity::kSpeed, kPositive, &speed);
    v.Number(Optional({"radius"}), Quantity::kLength, kPositive, &none);
    v.Number({"extent"}, Quantity::kLength, kPositive, &none);  // 0 may not be written
    v.Boolean({"on"}, &on);
    v.Switch({"drag"}, [](Visitor& t) {
      double c = 1.1;
      t.Number({"coefficient"}, Quantity::kNumber, kAnyValue, &c);
    });
  };
  EXPECT_EQ(Read("length = \"20 mm\"", read).filled,
            "length = \"20 mm\"\nspeed = 2.0\non = true\ndrag = false\n");
  EXPECT_EQ(Read("drag = true\non = false", read).filled,
            "length = 1.0\nspeed = 2.0\non = false\n\n[drag]\ncoefficient = 1.1\n");
}

TEST(TomlReader, FilesThatAreNoTextsAreRefusedAtOnce) {
  const std::filesystem::path folder = testing::TempDir();
  const auto message = [](const std::filesystem::path& file) -> std::string {
    try {
      ReadTextFile(file);
    } catch (const BadScene& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message("/dev/zero"), "/dev/zero: cannot be read: is no regular file");
  EXPECT_EQ(message("/nowhere/a.toml"), "/nowhere/a.toml: cannot be read: no such file");
  EXPECT_NE(message(folder), "");
  std::ofstream(folder / "empty.toml");
  EXPECT_EQ(message(folder / "empty.toml"), "");
}

}  // namespace
}  // namespace mantle::scene
