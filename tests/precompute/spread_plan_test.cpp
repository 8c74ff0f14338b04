// When a factor is spread over processes.
#include "precompute/spread_plan.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"

namespace palpate::spread_plan_test {
namespace {

/// Numbers that need a thousandth of the factor.
class SmallNumbers : public SpreadNumbers {
 public:
  void factorize() override {}
  std::vector<double> solve(std::span<const double> b, std::int64_t /*columns*/) override {
    return {b.begin(), b.end()};
  }
  void multiply(std::span<const std::int64_t> /*from*/, std::int64_t /*columns*/,
                std::span<const double> /*f*/, std::span<const std::int64_t> /*to*/,
                std::span<double> /*u*/) override {}
  void serve(const std::function<bool()>& /*interrupted*/) override {}
  void release() override {}
  [[nodiscard]] bool interrupted() const override { return false; }
  [[nodiscard]] SpreadMemory memory() const override { return {.expected = 1000, .expected_all = 2000}; }
};

/// A process that says there are others.
class Spreader : public Team {
 public:
  [[nodiscard]] bool can_spread() const override { return true; }
  std::unique_ptr<SpreadNumbers> spread(const SparseMatrix&, const Factor&, int) override {
    ++spread_;
    return std::make_unique<SmallNumbers>();
  }
  [[nodiscard]] bool prints() const override { return false; }
  [[nodiscard]] int spread_times() const { return spread_; }

 private:
  int spread_ = 0;
};

class SpreadPlan : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "model.toml")
        << "name = \"cube\"\n[geometry]\nbox = { size = [1, 1, 1], cells = [10, 10, 10] }\n"
           "[material]\nyoungs_modulus = 1.0\npoissons_ratio = 0.3\n"
           "[[fixed]]\nhalf_space = { point = [0, 0, 0], normal = [0, 0, -1] }\n";
  }
  void TearDown() override {
    ::unsetenv("SLURM_MEM_PER_NODE");
    std::filesystem::remove_all(folder_);
  }

  /// How many times a dry run with so much memory [MB] spreads the factor.
  int spread_with(const char* memory, Spreading spreading, int jobs) {
    ::setenv("SLURM_MEM_PER_NODE", memory, 1);
    Spreader team;
    BakeOptions options;
    options.output = folder_ / "x.palpate.hdf";
    options.jobs = jobs;
    options.dry_run = true;
    options.spreading = spreading;
    bake(read_description(folder_ / "model.toml"), options, team);
    return team.spread_times();
  }

  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / "palpate_spread_plan_test";
};

TEST_F(SpreadPlan, OnlyWhereTheFactorDoesNotFit) {
  EXPECT_EQ(spread_with("1000", Spreading::where_needed, 1), 0);
  // 8 threads' blocks of columns need more, which processes that solve together do not have.
  EXPECT_EQ(spread_with("30", Spreading::where_needed, 8), 1);
}

TEST_F(SpreadPlan, AlwaysOrNeverWhereThatIsAskedFor) {
  EXPECT_EQ(spread_with("1000", Spreading::always, 1), 1);
  EXPECT_THROW(spread_with("30", Spreading::never, 8), Error);
}

TEST_F(SpreadPlan, MoreProcessesNeedLessEachAndMoreInAll) {
  SparseMatrix K(4, 4);
  K.setIdentity();
  const std::vector<std::int64_t> node_start = {0, 1, 2, 3, 4};
  const Factor factor(K, node_start);
  SpreadMemory before = expected_spread_memory(factor, 1);
  EXPECT_EQ(before.expected, before.expected_all);
  for (const int ranks : {2, 4, 64}) {
    const SpreadMemory memory = expected_spread_memory(factor, ranks);
    EXPECT_LT(memory.expected, before.expected);
    EXPECT_GT(memory.expected_all, before.expected_all);
    before = memory;
  }
}

}  // namespace
}  // namespace palpate::spread_plan_test
