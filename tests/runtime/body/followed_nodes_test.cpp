// Stored nodes that surface nodes follow, and what is kept of the compliance between them.
#include "runtime/core/body/followed_nodes.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/bodies/runtime_model.h"
#include "tests/support/compression/hierarchical_sample.h"

namespace palpate::followed_nodes_test {
namespace {

/// Places come and go in any order; each one's compliance is that of its parts all the time.
TEST(FollowedNodes, KeepTheComplianceOfThoseThatAreHere) {
  for (const Index d : {2, 3}) {
    constexpr Index stored = 40, places = 24, parts = 3;
    const Eigen::MatrixXd first = test::random_definite(d * stored, 3);
    std::shared_ptr<const Greens> greens = make_greens(test::pack(first, Precision::double_precision), d, {});
    FollowedNodes followed(d, places, parts, stored, true);
    std::mt19937 random(7);
    const auto below = [&](Index n) { return static_cast<Index>(random() % static_cast<unsigned>(n)); };
    std::vector<std::vector<std::pair<Index, double>>> of_place;
    for (int round = 0; round < 400; ++round) {
      const auto count = static_cast<Index>(of_place.size());
      if (count == places || (count > 0 && below(3) == 0)) {
        const Index gone = below(count);
        followed.leave(gone, count);
        if (gone != count - 1) followed.move(count - 1, gone);
        of_place[static_cast<std::size_t>(gone)] = of_place.back();
        of_place.pop_back();
      } else {
        auto& added = of_place.emplace_back();
        for (Index part = 0; part <= below(parts); ++part) {
          added.emplace_back(below(stored), 0.25 * (1 + below(3)));
          followed.add(count, added.back().first, added.back().second);
        }
      }
      if (round == 200) {
        greens = make_greens(test::pack(2.0 * first, Precision::double_precision), d, {});
        followed.forget_compliance();
      }
      if (of_place.empty() || below(4) == 0) continue;  // not looked at in each round
      const auto asked = below(static_cast<Index>(of_place.size()));
      const auto here = std::ssize(followed.nodes());
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows =
          Eigen::MatrixXd::Zero(d, d * here);
      followed.add_compliance(*greens, asked, {rows.data(), static_cast<std::size_t>(rows.size())});
      for (Eigen::Index k = 0; k < here; ++k) {
        Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(d, d);
        for (const auto& [node, weight] : of_place[static_cast<std::size_t>(asked)])
          expected += weight * greens->block(node, followed.nodes()[static_cast<std::size_t>(k)]);
        ASSERT_LE((rows.middleCols(d * k, d) - expected).cwiseAbs().maxCoeff(), 1e-12) << round;
      }
    }
  }
}

}  // namespace
}  // namespace palpate::followed_nodes_test
