#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "meshes/error.h"
#include "runtime/body.h"
#include "tests/runtime_model.h"

namespace palpate {
namespace {

TEST(Body, FindsStoredNodesBothWays) {
  const Body body(test::unit_model(3, 3, Scope::surface, Precision::double_precision));
  // 4^3 nodes: 16 clamped, 8 inside.
  EXPECT_EQ(body.dimension(), 3);
  EXPECT_EQ(body.greens().nodes(), 40);
  EXPECT_EQ(body.free_surface_nodes().size(), 40U);
  EXPECT_EQ(body.stored_node(0), -1) << "clamped";
  EXPECT_EQ(body.stored_node(1 + 4 + 16), -1) << "inside";
  for (Index stored = 0; stored < body.greens().nodes(); ++stored) {
    EXPECT_EQ(body.stored_node(body.mesh_node(stored)), stored);
  }
  EXPECT_EQ(body.model().greens.order(), 0) << "greens() has them";
}

TEST(Body, InThePlaneTheBoundaryIsTouched) {
  const Body body(test::unit_model(2, 3, Scope::surface, Precision::double_precision));
  // 4^2 nodes: 4 clamped, 4 inside.
  EXPECT_EQ(body.dimension(), 2);
  EXPECT_EQ(body.greens().order(), 16);
  EXPECT_EQ(body.greens().nodes(), 8);
  EXPECT_EQ(body.free_surface_nodes().size(), 8U);
  EXPECT_EQ(body.stored_node(1), -1) << "clamped";
  EXPECT_EQ(body.stored_node(1 + 4), -1) << "inside";
  EXPECT_GE(body.stored_node(4), 0);
}

/// In the plane and in space.
class Bodies : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, Bodies, testing::Values(2, 3));

TEST_P(Bodies, ScopeFullStoresInnerNodesThatAreNotTouched) {
  const Body body(test::unit_model(GetParam(), 3, Scope::full, Precision::double_precision));
  EXPECT_EQ(body.greens().nodes(), GetParam() == 3 ? 48 : 12);
  EXPECT_EQ(body.free_surface_nodes().size(), GetParam() == 3 ? 40U : 8U);
}

TEST_P(Bodies, NearestSurfaceNodeIsThatOfAPlainSearch) {
  Model model = test::unit_model(GetParam(), 5, Scope::full, Precision::single_precision);
  test::set_rest(model, 0.2);
  const Body body(std::move(model));
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-0.5, 1.5);
  for (int k = 0; k < 500; ++k) {
    Vec3 point(coordinate(random), coordinate(random), coordinate(random));
    const NearestNode nearest = body.nearest_surface_node(point);
    if (GetParam() == 2) point.z() = 0.0;
    double expected = 1e9;
    for (const Index node : body.free_surface_nodes())
      expected = std::min(expected, (body.rest_position(node) - point).norm());
    EXPECT_DOUBLE_EQ(nearest.distance, expected);
    EXPECT_DOUBLE_EQ((body.rest_position(nearest.node) - point).norm(), expected);
    const auto& surface = body.free_surface_nodes();
    EXPECT_NE(std::find(surface.begin(), surface.end(), nearest.node), surface.end());
  }
}

TEST_P(Bodies, RestWhereTheirLoadsPutThem) {
  Model model = test::unit_model(GetParam(), 4, Scope::surface, Precision::single_precision);
  const Body unloaded{Model(model)};
  test::set_rest(model, 0.1);
  const std::vector<Vec3> u0 = model.rest_displacement;
  const Body body(std::move(model));
  for (const Index node : body.free_surface_nodes()) {
    const auto mesh_node = static_cast<std::size_t>(body.mesh_node(node));
    EXPECT_GT(u0[mesh_node].norm(), 0.0);
    EXPECT_EQ(unloaded.rest_position(node), body.model().mesh.nodes[mesh_node]);
    EXPECT_EQ(body.rest_position(node), body.model().mesh.nodes[mesh_node] + u0[mesh_node]);
    EXPECT_EQ(body.nearest_surface_node(body.rest_position(node)).node, node);
    EXPECT_EQ(body.nearest_surface_node(body.rest_position(node)).distance, 0.0);
  }
}

TEST_P(Bodies, FarAwayIsInfinitelyFar) {
  const Body body(test::unit_model(GetParam(), 2, Scope::surface, Precision::single_precision));
  const NearestNode nearest = body.nearest_surface_node(Vec3::Constant(1e300));
  EXPECT_TRUE(std::isinf(nearest.distance));
}

TEST(Body, KnowsTheLongestEdgeOfTheSurfaceAtRest) {
  for (const int dimension : {2, 3}) {
    Model model = test::unit_model(dimension, 4, Scope::surface, Precision::single_precision);
    const double longest = dimension == 3 ? std::sqrt(2.0) / 4.0 : 0.25;  // the diagonal of a cell's face
    EXPECT_DOUBLE_EQ(Body{Model(model)}.longest_surface_edge(), longest);
    for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node)
      model.rest_displacement[node] = 0.5 * model.mesh.nodes[node];
    EXPECT_DOUBLE_EQ(Body(std::move(model)).longest_surface_edge(), 1.5 * longest);
  }
}

TEST(Body, RefusesABodyThatCannotBeTouched) {
  Model model = test::unit_model(3, 2, Scope::surface, Precision::double_precision);
  model.surface.clear();
  try {
    const Body body(std::move(model));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("free to move"), std::string::npos) << error.what();
    EXPECT_EQ(error.where(), "box");
  }
}

TEST_P(Bodies, RefuseThePartsOfAnotherBody) {
  const Model good = test::unit_model(GetParam(), 2, Scope::surface, Precision::double_precision);
  Model model = good;
  model.stored_nodes.pop_back();
  EXPECT_THROW(Body(std::move(model)), Error);

  model = good;
  model.rest_displacement.pop_back();
  try {
    const Body body(std::move(model));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("rest displacement"), std::string::npos) << error.what();
  }

  model = good;
  model.fixed.pop_back();
  try {
    const Body body(std::move(model));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("held axes"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace palpate
