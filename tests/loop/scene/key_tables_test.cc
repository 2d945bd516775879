#include "loop/scene/key_tables.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "loop/scene/scene_schema.h"

namespace mantle::scene {
namespace {

using schema::Optional;
using schema::Required;
using schema::Visitor;

std::string ReadFile(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(KeyTables, TheCommittedPageIsWhatTheDescriptionsGive) {
  const std::string page = ReadFile(MANTLE_SOURCE_DIR "/docs/scene.md");
  ASSERT_FALSE(page.empty());
  EXPECT_EQ(WithKeyTables(SceneCatalogue(), page), page)
      << "bring it up to date: mantle check --docs docs/scene.md";
}

Catalogue Small() {
  return MakeCatalogue([](Visitor& v) {
    v.Table({"goal", "where to"}, [](Visitor& t) {
      int type = 0;
      double speed = 0;
      t.Cases({"type"}, {"cruise", "path"}, &type, [&](int which) {
        speed = which == 0 ? 0.1 : 0.08;
        t.Number({"speed"}, schema::Quantity::kSpeed, schema::kPositive, &speed);
        if (which == 1)
          t.Number(Required({"ramp", "from rest"}), schema::Quantity::kTime, schema::kNonNegative,
                   &speed);
      });
      double a = 0;
      t.OneOf("a goal", false,
              {{"near",
                [&] {
                  t.Number({"near"}, schema::Quantity::kNumber, {0, 1}, &a);
                }},
               {"far", [&] {
                  t.Number({"far"}, schema::Quantity::kNumber, {1, 9}, &a);
                }}});
    });
  });
}

TEST(KeyTables, RowsSayTypeUnitDefaultBoundAndMeaning) {
  const std::string title =
      "| key | type | unit | default | bound | meaning |\n|---|---|---|---|---|---|\n";
  EXPECT_EQ(KeyTable(Small(), "scene"), title + "| `goal` | table |  |  |  | where to |\n");
  EXPECT_EQ(KeyTable(Small(), "goal"),
            title +
                "| `goal.type` | text |  | `\"cruise\"` | `\"cruise\"`, `\"path\"` |  |\n"
                "| `goal.speed` | number | m/s | cruise 0.1; path 0.08 | > 0 | cruise, path |\n"
                "| `goal.ramp` | number | s | required | >= 0 | path: from rest |\n"
                "| `goal.near` | number |  | none | [0, 1]; this or `far` |  |\n"
                "| `goal.far` | number |  | none | [1, 9]; this or `near` |  |\n");
}

TEST(KeyTables, APageHoldsEveryPartOnce) {
  const auto page = [](const std::string& first, const std::string& second) {
    return "A\n<!-- keys: " + first + " -->\nold\n<!-- end of keys -->\nB\n<!-- keys: " + second +
           " -->\n<!-- end of keys -->\nC\n";
  };
  const std::string whole = WithKeyTables(Small(), page("scene", "goal"));
  EXPECT_EQ(whole.find("old"), std::string::npos);
  EXPECT_NE(whole.find("`goal.ramp`"), std::string::npos);
  EXPECT_EQ(WithKeyTables(Small(), whole), whole);
  EXPECT_THROW(WithKeyTables(Small(), page("scene", "gaol")), std::invalid_argument);
  EXPECT_THROW(WithKeyTables(Small(), page("scene goal", "goal")), std::invalid_argument);
  EXPECT_THROW(WithKeyTables(Small(), "<!-- keys: scene -->\n<!-- end of keys -->\n"),
               std::invalid_argument)
      << "the keys of goal stand nowhere";
  EXPECT_THROW(WithKeyTables(Small(), "<!-- keys: scene goal -->\n"), std::invalid_argument);
}

}  // namespace
}  // namespace mantle::scene
