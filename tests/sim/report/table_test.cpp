#include "report/table.h"

#include <gtest/gtest.h>

#include <cmath>

namespace arex::sim {
namespace {

TEST(Table, ReadsQuotedCells) {
  const Table table = parse_table("a,b\n1,\"x, \"\"y\"\"\nz\"\n2,\r\n");
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.text(0, "b"), "x, \"y\"\nz");
  EXPECT_EQ(table.text(1, "b"), "");
  EXPECT_EQ(table.text(1, "c"), "");
}

TEST(Table, LeavesOutTheRowThatAKillCutShort) {
  EXPECT_EQ(parse_table("a,b\n1,2\n3,4").rows.size(), 1U);
  EXPECT_EQ(parse_table("a,b\n1,2\n3").rows.size(), 1U);
  EXPECT_EQ(parse_table("a,b\n1\n3,4\n").rows.size(), 1U);  // nor one with cells missing
  EXPECT_TRUE(parse_table("a,b").columns.empty());
  EXPECT_TRUE(parse_table("").columns.empty());
}

TEST(Table, NumbersAreWholeCells) {
  const Table table = parse_table("v\n1.5\n\n-2e3\n3x\nnan\ninf\n");
  const std::vector<double> values = table.numbers("v");
  ASSERT_EQ(values.size(), 6U);
  EXPECT_EQ(values[0], 1.5);
  EXPECT_EQ(values[2], -2000);
  for (const std::size_t i : {1U, 3U, 4U, 5U}) EXPECT_TRUE(std::isnan(values[i])) << i;
  // A column that is not there has a cell in every row all the same: files are damaged, too.
  ASSERT_EQ(table.numbers("w").size(), table.rows.size());
  for (const double cell : table.numbers("w")) EXPECT_TRUE(std::isnan(cell));
}

}  // namespace
}  // namespace arex::sim
