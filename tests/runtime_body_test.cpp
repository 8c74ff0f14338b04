#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "meshes/error.h"
#include "runtime/body.h"
#include "tests/runtime_model.h"

namespace palpate {
namespace {

TEST(Body, FindsStoredNodesBothWays) {
  const Body body(test::box_model(3, Scope::surface, Precision::double_precision));
  // 4^3 nodes: 16 clamped, 8 inside.
  EXPECT_EQ(body.greens().nodes(), 40);
  EXPECT_EQ(body.free_surface_nodes().size(), 40U);
  EXPECT_EQ(body.stored_node(0), -1) << "clamped";
  EXPECT_EQ(body.stored_node(1 + 4 + 16), -1) << "inside";
  for (Index stored = 0; stored < body.greens().nodes(); ++stored) {
    EXPECT_EQ(body.stored_node(body.mesh_node(stored)), stored);
  }
  EXPECT_EQ(body.model().greens.order(), 0) << "greens() has them";
}

TEST(Body, ScopeFullStoresInnerNodesThatAreNotTouched) {
  const Body body(test::box_model(3, Scope::full, Precision::double_precision));
  EXPECT_EQ(body.greens().nodes(), 48);
  EXPECT_EQ(body.free_surface_nodes().size(), 40U);
}

TEST(Body, NearestSurfaceNodeIsThatOfAPlainSearch) {
  const Body body(test::box_model(5, Scope::full, Precision::single_precision));
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-0.5, 1.5);
  for (int k = 0; k < 500; ++k) {
    const Vec3 point(coordinate(random), coordinate(random), coordinate(random));
    double expected = 1e9;
    for (const Index node : body.free_surface_nodes())
      expected = std::min(expected, (body.position(node) - point).norm());
    const NearestNode nearest = body.nearest_surface_node(point);
    EXPECT_DOUBLE_EQ(nearest.distance, expected);
    EXPECT_DOUBLE_EQ((body.position(nearest.node) - point).norm(), expected);
    const auto& surface = body.free_surface_nodes();
    EXPECT_NE(std::find(surface.begin(), surface.end(), nearest.node), surface.end());
  }
}

TEST(Body, FarAwayIsInfinitelyFar) {
  const Body body(test::box_model(2, Scope::surface, Precision::single_precision));
  const NearestNode nearest = body.nearest_surface_node(Vec3::Constant(1e300));
  EXPECT_TRUE(std::isinf(nearest.distance));
}

TEST(Body, KnowsTheLongestEdgeOfTheSurface) {
  const Body body(test::box_model(4, Scope::surface, Precision::single_precision));
  EXPECT_DOUBLE_EQ(body.longest_surface_edge(), std::sqrt(2.0) / 4.0) << "the diagonal of a cell's face";
}

TEST(Body, RefusesABodyThatCannotBeTouched) {
  Model model = test::box_model(2, Scope::surface, Precision::double_precision);
  model.surface_triangles.clear();
  try {
    const Body body(std::move(model));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("free to move"), std::string::npos) << error.what();
    EXPECT_EQ(error.where(), "box");
  }
}

TEST(Body, RefusesGreensFunctionsOfAnotherBody) {
  Model model = test::box_model(2, Scope::surface, Precision::double_precision);
  model.stored_nodes.pop_back();
  EXPECT_THROW(Body(std::move(model)), Error);
}

}  // namespace
}  // namespace palpate
