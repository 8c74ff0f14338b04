// Work that processes share: here two teams of threads, who know of each other what they exchange alone.
#include <gtest/gtest.h>

#include <array>
#include <barrier>
#include <thread>

#include "precompute/team.h"

namespace palpate::team_sharing_test {
namespace {

/// What two processes have between them.
struct Wire {
  std::barrier<> both{2};
  std::array<std::string, 2> bytes;
  std::array<bool, 2> whole{};
};

/// One of two: it solves every other tile.
class HalfTeam : public Team {
 public:
  HalfTeam(Wire& wire, int rank) : wire_(wire), rank_(rank) {}

  [[nodiscard]] bool leads() const override { return rank_ == 0; }
  [[nodiscard]] int rank() const override { return rank_; }
  [[nodiscard]] int size() const override { return 2; }

  bool work(const std::vector<Tile>& tiles, int /*jobs*/, const TileWork& work) override {
    for (const Tile& tile : tiles)
      if (tile.first % 2 == rank_ && !work.interrupted()) work.solve(tile, 0);
    wire_.both.arrive_and_wait();
    for (const Tile& tile : tiles)
      if (leads()) work.done(tile);
    wire_.whole[static_cast<std::size_t>(rank_)] = !work.interrupted();
    wire_.both.arrive_and_wait();
    return wire_.whole[0] && wire_.whole[1];
  }

  void exchange(const std::string& bytes, const std::function<void(std::string_view)>& take) override {
    wire_.bytes[static_cast<std::size_t>(rank_)] = bytes;
    wire_.both.arrive_and_wait();
    take(wire_.bytes[static_cast<std::size_t>(1 - rank_)]);
    wire_.both.arrive_and_wait();
  }

 private:
  Wire& wire_;
  int rank_;
};

struct Outcome {
  bool whole = false;
  int worked = 0, told = 0;
  std::vector<std::vector<double>> results;
};

/// Item k's results are k numbers k.
Outcome share(Wire& wire, int rank, bool interrupted) {
  HalfTeam team(wire, rank);
  TeamSharing sharing(team, 1, [=] { return interrupted; });
  Outcome outcome;
  outcome.results.resize(7);
  SharedItems items;
  items.count = 7;
  items.work = [&](std::int64_t item, int) {
    ++outcome.worked;
    outcome.results[static_cast<std::size_t>(item)].assign(static_cast<std::size_t>(item),
                                                           static_cast<double>(item));
  };
  items.carry = [&](std::int64_t item, Parcel& results) {
    results.carry(outcome.results[static_cast<std::size_t>(item)]);
  };
  items.done = [&](double) {
    ++outcome.told;
    return true;
  };
  outcome.whole = sharing.for_each(items);
  return outcome;
}

std::array<Outcome, 2> share_by_two(bool second_interrupted) {
  Wire wire;
  std::array<Outcome, 2> outcomes;
  {
    const std::jthread first([&] { outcomes[0] = share(wire, 0, false); });
    const std::jthread second([&] { outcomes[1] = share(wire, 1, second_interrupted); });
  }
  return outcomes;
}

TEST(TeamSharing, GivesAllTheResultsToAll) {
  const auto outcomes = share_by_two(false);
  EXPECT_EQ(outcomes[0].worked, 4);
  EXPECT_EQ(outcomes[1].worked, 3);
  EXPECT_EQ(outcomes[0].told, 7);
  EXPECT_EQ(outcomes[1].told, 0);
  for (const Outcome& outcome : outcomes) {
    EXPECT_TRUE(outcome.whole);
    for (std::size_t k = 0; k < 7; ++k)
      EXPECT_EQ(outcome.results[k], std::vector<double>(k, static_cast<double>(k)));
  }
}

TEST(TeamSharing, EndsInAllWhereOneIsInterrupted) {
  for (const Outcome& outcome : share_by_two(true)) EXPECT_FALSE(outcome.whole);
}

}  // namespace
}  // namespace palpate::team_sharing_test
