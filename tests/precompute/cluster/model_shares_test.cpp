// Several models over the ranks.
#include "precompute/cluster/model_shares.h"

#include <gtest/gtest.h>

namespace palpate::model_shares_test {
namespace {

using Names = std::vector<std::string>;

TEST(ModelShares, LargeModelsAreByAllAndTheOthersSideBySide) {
  const ModelShares shares = share_models({"a", "huge", "b", "c"}, {1.0, 100.0, 3.0, 2.0}, 2);
  EXPECT_EQ(shares.by_all, Names{"huge"});
  EXPECT_EQ(shares.by_rank, (std::vector<Names>{{"b"}, {"c", "a"}}));
}

TEST(ModelShares, EqualModelsAreSideBySideWhateverTheNoiseOfTheirEstimates) {
  const ModelShares shares = share_models({"a", "b"}, {1.0, 1.2}, 2);
  EXPECT_EQ(shares.by_all, Names{});
  EXPECT_EQ(shares.by_rank, (std::vector<Names>{{"b"}, {"a"}}));
}

TEST(ModelShares, MoreRanksThanModels) {
  const ModelShares shares = share_models({"a"}, {1.0}, 4);
  EXPECT_EQ(shares.by_all, Names{"a"});
  EXPECT_EQ(shares.by_rank, std::vector<Names>(4));
}

}  // namespace
}  // namespace palpate::model_shares_test
