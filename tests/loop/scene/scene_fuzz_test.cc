#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <random>

#include "loop/scene/scene.h"
#include "tests/support/paths.h"

/// Scenes that are changed at random: values of every kind in every place, keys gone, doubled,
/// misspelt, tables and arrays emptied or repeated.

namespace mantle::scene {
namespace {

constexpr int kMutantsPerScene = 60;
constexpr std::size_t kLongestMessage_bytes = 1000;  // a list of the keys of a table is the longest

using Random = std::mt19937;

int Pick(Random& random, std::size_t count) {
  return std::uniform_int_distribution<int>(0, static_cast<int>(count) - 1)(random);
}

TomlValue Odd(Random& random) {
  static const std::vector<double> kNumbers = {0,
                                               1,
                                               -1,
                                               0.5,
                                               -0.0,
                                               1e-300,
                                               1e300,
                                               1e17,
                                               5e-324,
                                               -3.7,
                                               3,
                                               1000,
                                               1e100,
                                               100000,
                                               200000,
                                               std::numeric_limits<double>::quiet_NaN(),
                                               std::numeric_limits<double>::infinity()};
  static const std::vector<std::string> kTexts = {
      "",      "1 m", "1 mm",   "nan m",    "inf N", "-1 s",     "clamped", "free",
      "table", "a",   "sdirk2", "true",     "1e999", "\n\t\x01", "loop",    "../x",
      "1 kPa", "arm", "arm.a",  "\xc3\xa9", "mpc",   "intervals"};
  switch (Pick(random, 7)) {
    case 0:
    case 1:
      return TomlNumber(kNumbers[Pick(random, kNumbers.size())]);
    case 2:
      return TomlInteger(Pick(random, 5) - 1);
    case 3:
      return TomlBoolean(Pick(random, 2) == 0);
    case 4:
      return TomlText(kTexts[Pick(random, kTexts.size())]);
    case 5:
      return TomlNumbers(std::vector<double>(Pick(random, 7), kNumbers[Pick(random, 5)]));
    default:
      return TomlValue{};
  }
}

// Every value below `value` that can be changed.
void Collect(TomlValue* value, std::vector<TomlValue*>* all) {
  all->push_back(value);
  for (TomlValue& item : value->items) Collect(&item, all);
}

void Mutate(Random& random, TomlValue* document) {
  std::vector<TomlValue*> all;
  Collect(document, &all);
  TomlValue* at = all[Pick(random, all.size())];
  if (at->items.empty() || at == document) {
    if (at != document) *at = Odd(random);
    return;
  }
  const int item = Pick(random, at->items.size());
  const bool table = at->kind == TomlValue::Kind::kTable;
  switch (Pick(random, 5)) {
    case 0:  // gone
      at->items.erase(at->items.begin() + item);
      if (table) at->keys.erase(at->keys.begin() + item);
      break;
    case 1:  // replaced
      at->items[item] = Odd(random);
      break;
    case 2:  // moved from elsewhere
      at->items[item] = TomlValue(*all[Pick(random, all.size())]);
      break;
    case 3:  // once more, or under a name that is none
      if (table) {
        at->keys[item] += "x";
      } else {
        at->items.push_back(TomlValue(at->items[item]));
      }
      break;
    default:
      *at = Odd(random);
  }
}

TEST(SceneFuzz, AnyChangeIsReadOrRefusedInOneLineAndWhatIsReadReadsBack) {
  Random random(20240607);
  int read = 0, refused = 0;
  for (const auto& entry : std::filesystem::directory_iterator(tests::SourcePath("scenes"))) {
    if (entry.path().extension() != ".toml") continue;
    const TomlValue whole = ParseToml(LoadScene(entry.path()).text, "s.toml");
    for (int i = 0; i < kMutantsPerScene; ++i) {
      TomlValue document = whole;
      for (int k = Pick(random, 3); k >= 0; --k) Mutate(random, &document);
      const std::string text = WriteToml(document);
      SCOPED_TRACE(text);
      std::string filled;
      try {
        filled = ParseScene(text, "s.toml", tests::SourcePath("scenes")).text;
        ++read;
      } catch (const BadScene& error) {
        const std::string what = error.what();
        ++refused;
        ASSERT_EQ(what.find('\n'), std::string::npos) << what;
        ASSERT_LT(what.size(), kLongestMessage_bytes) << what;
        ASSERT_EQ(what.rfind("s.toml: ", 0), 0u) << what;
        continue;
      }
      ASSERT_EQ(ParseScene(filled, "s.toml", tests::SourcePath("scenes")).text, filled);
    }
  }
  EXPECT_GT(read, 100) << "of " << read + refused;
  EXPECT_GT(refused, 100) << "of " << read + refused;
}

}  // namespace
}  // namespace mantle::scene
