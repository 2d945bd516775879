#include "tools/report/csv_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/mantle/bad_input.h"

namespace mantle::testing_tools {
namespace {

using namespace tools;

TEST(CsvTable, NumbersReadBackAndWordsAreNone) {
  const CsvTable table =
      ParseCsv("time_s,cost,outcome\n0,1e-300,\"solved, late\"\n0.1,-2,x\n", "t");
  ASSERT_EQ(table.rows(), 2U);
  EXPECT_EQ(table.titles, (std::vector<std::string>{"time_s", "cost", "outcome"}));
  EXPECT_EQ((*table.Find("cost"))[0], 1e-300);
  EXPECT_EQ((*table.Find("cost"))[1], -2.0);
  EXPECT_TRUE(std::isnan((*table.Find("outcome"))[0]));
  EXPECT_EQ(table.Find("nothing"), nullptr);
  EXPECT_FALSE(table.cut_short);
}

TEST(CsvTable, ARowWithoutItsEndIsLeftOut) {
  const CsvTable table = ParseCsv("a,b\n1,2\n3,", "t");
  EXPECT_TRUE(table.cut_short);
  EXPECT_EQ(table.rows(), 1U);
}

TEST(CsvTable, RowsOfAnotherLengthAreRefusedByTheirLine) {
  try {
    ParseCsv("a,b\n1,2\n3\n", "some/file.csv");
    FAIL() << "must be refused";
  } catch (const BadInput& error) {
    EXPECT_STREQ(error.what(), "some/file.csv: line 3 has 1 cells, must be 2 as the titles");
  }
  EXPECT_THROW(ParseCsv("", "t"), BadInput);
}

}  // namespace
}  // namespace mantle::testing_tools
