// How tiles are shared among parts and threads.
#include "precompute/team.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <numeric>

namespace palpate::team_test {
namespace {

/// Tiles of `width` columns whose cost falls as that of the columns of a lower triangle does.
std::vector<Tile> triangle(std::int64_t tiles, std::int64_t width) {
  std::vector<Tile> all;
  for (std::int64_t k = 0; k < tiles; ++k) all.push_back({k * width, width, static_cast<double>(tiles - k)});
  return all;
}

TEST(Shares, AreAllTilesOnceInOrder) {
  for (const std::int64_t parts : {1, 2, 3, 7, 40, 100}) {
    const std::vector<Tile> tiles = triangle(40, 24);
    std::int64_t at = 0;
    for (std::int64_t number = 1; number <= parts; ++number) {
      const PieceRange share = share_of(tiles, number, parts);
      EXPECT_EQ(share.first, at) << number << " of " << parts;
      EXPECT_GE(share.end, share.first);
      EXPECT_EQ(share.end % 24, 0);
      at = share.end;
    }
    EXPECT_EQ(at, 40 * 24) << parts;
  }
}

// No share is off from the mean by more than a tile, half of which each of its ends may cut off or bring.
TEST(Shares, CostAboutTheSame) {
  const std::vector<Tile> tiles = triangle(200, 1);
  for (std::int64_t number = 1; number <= 7; ++number) {
    const PieceRange share = share_of(tiles, number, 7);
    double cost = 0.0;
    for (std::int64_t k = share.first; k < share.end; ++k) cost += tiles[static_cast<std::size_t>(k)].cost;
    EXPECT_NEAR(cost, 200.0 * 201.0 / 2.0 / 7.0, 200.0) << number;
  }
}

TEST(Shares, OfTilesThatCostNothing) {
  const std::vector<Tile> tiles = {{0, 5, 0.0}, {5, 5, 0.0}};
  EXPECT_EQ(share_of(tiles, 1, 2), (PieceRange{0, 10}));
  EXPECT_EQ(share_of(tiles, 2, 2), (PieceRange{10, 10}));
  EXPECT_EQ(share_of({}, 1, 2), (PieceRange{0, 0}));
}

TEST(Team, OfThreadsSolvesEachTileOnceAndTellsItsCost) {
  const std::vector<Tile> tiles = triangle(100, 1);
  std::vector<std::atomic<int>> solved(100);
  double cost = 0.0;
  Team team;
  EXPECT_TRUE(team.work(tiles, 3,
                        {[&](const Tile& tile, int worker) {
                           EXPECT_LT(worker, 3);
                           ++solved[static_cast<std::size_t>(tile.first)];
                         },
                         [&](const Tile& tile) { cost += tile.cost; }, [] { return false; }}));
  EXPECT_TRUE(std::all_of(solved.begin(), solved.end(), [](const auto& count) { return count == 1; }));
  EXPECT_EQ(cost, 100.0 * 101.0 / 2.0);
}

TEST(Team, StopsWhereItIsInterrupted) {
  int count = 0;
  Team team;
  EXPECT_FALSE(
      team.work(triangle(100, 1), 1,
                {[&](const Tile&, int) { ++count; }, [](const Tile&) {}, [&] { return count == 5; }}));
  EXPECT_EQ(count, 5);
}

}  // namespace
}  // namespace palpate::team_test
