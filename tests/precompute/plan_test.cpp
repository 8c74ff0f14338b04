// What a plan says of blocks of columns.
#include "precompute/plan.h"

#include <gtest/gtest.h>

namespace palpate::plan_test {
namespace {

Plan plan(std::int64_t columns, bool for_many, std::int64_t widest) {
  Plan plan;
  plan.stored_dofs = columns;
  plan.for_many = for_many;
  plan.block_columns = widest;
  return plan;
}

std::vector<std::int64_t> widths(const std::vector<PieceRange>& blocks) {
  std::vector<std::int64_t> widths;
  for (const PieceRange& block : blocks) widths.push_back(block.end - block.first);
  return widths;
}

void expect_next_to_each_other(const std::vector<PieceRange>& blocks, std::int64_t columns) {
  std::int64_t next = 0;
  for (const PieceRange& block : blocks) {
    EXPECT_EQ(block.first, next);
    next = block.end;
  }
  EXPECT_EQ(next, columns);
}

TEST(ColumnBlocks, AreEquallyWideForFewThreads) {
  const std::vector<PieceRange> blocks = column_blocks(plan(500, false, 192));
  EXPECT_EQ(widths(blocks), (std::vector<std::int64_t>{192, 192, 116}));
  expect_next_to_each_other(blocks, 500);
}

TEST(ColumnBlocks, DifferForManyThreadsAndAreNarrowAtTheEnd) {
  const std::vector<PieceRange> blocks = column_blocks(plan(2640, true, 84));
  expect_next_to_each_other(blocks, 2640);
  const std::vector<std::int64_t> wide = widths(blocks);
  const std::vector<std::int64_t> four = {84, 72, 60, 48};
  std::size_t k = 0;
  for (; blocks[k].first < 2112; ++k) EXPECT_EQ(wide[k], four[k % 4]) << k;  // four fifths of them
  EXPECT_EQ(k, 32U);
  EXPECT_EQ(wide.size(), 32U + 22U);
  for (; k < wide.size(); ++k) EXPECT_EQ(wide[k], 24) << k;
}

TEST(ColumnBlocks, AreNoWiderThanMemoryAllows) {
  const std::vector<PieceRange> blocks = column_blocks(plan(1000, true, 48));
  expect_next_to_each_other(blocks, 1000);
  for (const std::int64_t width : widths(blocks)) EXPECT_LE(width, 48);
}

TEST(ColumnBlocks, OfNoColumnsAreNone) {
  EXPECT_TRUE(column_blocks(plan(0, true, 84)).empty());
}

}  // namespace
}  // namespace palpate::plan_test
