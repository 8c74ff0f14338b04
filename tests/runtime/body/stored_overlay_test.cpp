// Patches that come from the file in place of being condensed.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "overlay/condensation.h"
#include "runtime/background/patch_source.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::stored_overlay_test {
namespace {

constexpr int refinement = 2, rings = 1;

/// A body that is touched on top, without the file's patches or with one round each node of its top, which
/// `spoil` may change.
template <class Spoil>
Model model_with_overlay(int dimension, Spoil&& spoil) {
  Model model = test::unit_model(dimension, 4, Scope::full, Precision::double_precision);
  const ElementsAtNodes at(model.mesh);
  model.overlay.refinement = refinement;
  model.overlay.rings = rings;
  for (Index node = 0; node < static_cast<Index>(model.mesh.nodes.size()); ++node) {
    if (model.mesh.nodes[static_cast<std::size_t>(node)][dimension - 1] < 1.0 - 1e-9) continue;
    model.overlay.centres.push_back(node);
    model.overlay.patches.push_back(condense(
        model, make_patch_mesh(model, at, rings_round(model.mesh, at, {&node, 1}, rings), refinement)));
    spoil(model.overlay.patches.back());
  }
  return model;
}

std::vector<double> numbers(const Patch& patch, int dimension) {
  const auto m = dimension * std::ssize(patch.surface_nodes());
  const auto g = dimension * std::ssize(patch.stored_nodes());
  std::vector<double> all;
  const auto add = [&](const double* row, std::ptrdiff_t width) { all.insert(all.end(), row, row + width); };
  for (Index dof = 0; dof < m; ++dof) {
    add(patch.compliance(dof), m);
    add(patch.response(dof), g);
  }
  for (Index dof = 0; dof < g; ++dof) add(patch.correction(dof), g);
  return all;
}

class OverlayFromFile : public testing::TestWithParam<int> {
 protected:
  int d_ = GetParam();
  Body plain_{test::unit_model(d_, 4, Scope::full, Precision::double_precision), {}, refinement};
  Body stored_{model_with_overlay(d_, [](CondensedPatch&) {}), {}, refinement};
  /// Twice as soft a surface: what is not taken from the file does not show it.
  Body softer_{
      model_with_overlay(d_, [](CondensedPatch& patch) { patch.compliance *= 2.0; }), {}, refinement};

  [[nodiscard]] Index middle(const Body& body) const {
    return body.nearest_surface_node(test::top_middle(d_)).node;
  }
  [[nodiscard]] std::vector<double> made(const Body& body, const std::vector<Index>& centres,
                                         int n = rings) const {
    return numbers(*PatchMaker(body, n).make(centres), d_);
  }
};

INSTANTIATE_TEST_SUITE_P(Dimensions, OverlayFromFile, testing::Values(2, 3));

TEST_P(OverlayFromFile, PatchesAreTheSame) {
  EXPECT_EQ(made(stored_, {middle(stored_)}), made(plain_, {middle(plain_)}));
}

TEST_P(OverlayFromFile, PatchesAreReallyUsed) {
  const std::vector<double> exact = made(plain_, {middle(plain_)});
  const std::vector<double> softer = made(softer_, {middle(softer_)});
  ASSERT_EQ(softer.size(), exact.size());
  double change = 0.0;
  for (std::size_t k = 0; k < exact.size(); ++k) change = std::max(change, softer[k] - exact[k]);
  EXPECT_GT(change, 0.1 * *std::max_element(exact.begin(), exact.end()));
}

TEST_P(OverlayFromFile, PatchesAreOfOneCentreOneDepthAndOneRefinement) {
  const Index middle = this->middle(softer_);
  const Index other = PatchMaker(softer_, rings).neighbours(middle).front();
  EXPECT_EQ(made(softer_, {middle, other}), made(plain_, {middle, other}));
  EXPECT_EQ(made(softer_, {middle}, 2), made(plain_, {middle}, 2));
  const Index side = softer_.nearest_surface_node(test::upright(d_, 0.0, 0.5, 0.5)).node;
  EXPECT_EQ(made(softer_, {side}), made(plain_, {side}));
  const auto finer = [&](Model model) {
    const Body body(std::move(model), {}, 3);
    return made(body, {this->middle(body)});
  };
  EXPECT_EQ(finer(model_with_overlay(d_, [](CondensedPatch& patch) { patch.compliance *= 2.0; })),
            finer(test::unit_model(d_, 4, Scope::full, Precision::double_precision)));
}

TEST_P(OverlayFromFile, PatchesOfAnotherMeshAreRefused) {
  const auto expect_refused = [&](auto&& spoil) {
    const Body body(model_with_overlay(d_, spoil), {}, refinement);
    PatchMaker maker(body, rings);
    const Index centre = middle(body);
    try {
      const auto patch = maker.make({&centre, 1});
      ADD_FAILURE() << "taken, with " << patch->surface_nodes().size() << " surface nodes";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.hint()).find("precompute it again"), std::string::npos);
    }
  };
  expect_refused([](CondensedPatch& patch) { ++patch.surface.back(); });
  expect_refused([](CondensedPatch& patch) { patch.G = Eigen::MatrixXd(patch.G.topLeftCorner(2, 2)); });
  expect_refused([](CondensedPatch& patch) { patch.T = Eigen::MatrixXd(patch.T.leftCols(2)); });
  expect_refused(
      [](CondensedPatch& patch) { patch.compliance = Eigen::MatrixXd(patch.compliance.topRows(2)); });
}

/// Patches that are built while no tool is near, and the bytes that they take: once there are `expected` of
/// them, and no more come for a while.
std::pair<std::int64_t, std::size_t> built_ahead(const Body& body, std::size_t memory,
                                                 std::int64_t expected) {
  State state(body, {.tools = {Tool{.radius = 0.1}}, .patch_nodes = patch_room(body, rings, 1)});
  const PatchSource source(body, state, {.rings = rings, .memory = memory});
  std::int64_t before = -1;
  for (int k = 0; k < 2000 && (source.built() < expected || source.built() != before); ++k) {
    before = source.built();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return {source.built(), source.bytes()};
}

TEST_P(OverlayFromFile, PatchesAreMadeAheadOfTheTools) {
  EXPECT_EQ(built_ahead(plain_, std::size_t{512} << 20, 0).first, 0);
  const std::int64_t centres = std::ssize(stored_.model().overlay.centres);
  const auto [all, bytes] = built_ahead(stored_, std::size_t{512} << 20, centres);
  EXPECT_EQ(all, centres);
  const auto [some, fewer_bytes] = built_ahead(stored_, bytes / 2, 1);
  EXPECT_GT(some, 0);
  EXPECT_LT(some, all);
  EXPECT_LE(fewer_bytes, bytes / 2);
}

}  // namespace
}  // namespace palpate::stored_overlay_test
