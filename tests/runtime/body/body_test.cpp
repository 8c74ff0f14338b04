#include "runtime/body/body.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <span>
#include <string>

#include "base/error.h"
#include "meshes/topology.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::body_test {
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

TEST(Body, KnowsTheMeanEdgeOfTheSurfaceAtRest) {
  // Each of the 96 squares on a cube of 4^3 cells has a diagonal and shares its 4 sides with its neighbours.
  const double mean[] = {0.25, 0.25 * (2.0 + std::sqrt(2.0)) / 3.0};
  for (const int dimension : {2, 3}) {
    Model model = test::unit_model(dimension, 4, Scope::surface, Precision::single_precision);
    EXPECT_NEAR(Body{Model(model)}.mean_surface_edge(), mean[dimension - 2], 1e-14);
    for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node)
      model.rest_displacement[node] = 0.5 * model.mesh.nodes[node];
    EXPECT_NEAR(Body(std::move(model)).mean_surface_edge(), 1.5 * mean[dimension - 2], 1e-14);
  }
}

/// The surface of bodies of every kind of element.
class SurfaceOf : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Body, SurfaceOf, testing::ValuesIn(body_elements),
                         [](const auto& element) { return std::string(traits(element.param).name); });

TEST_P(SurfaceOf, NumbersItsOwnNodes) {
  Model model = test::unit_model(GetParam(), 2, Scope::full, Precision::double_precision);
  test::set_rest(model, 0.2);
  const Model given = model;
  const Body body(std::move(model));
  const auto nodes = body.surface_mesh_nodes();
  std::vector<Index> back;
  for (const Index node : body.simplices()) back.push_back(nodes[static_cast<std::size_t>(node)]);
  EXPECT_EQ(back, given.surface) << "the same simplices, so outward too";

  const std::set<Index> expected(given.surface.begin(), given.surface.end());
  EXPECT_EQ(std::vector<Index>(nodes.begin(), nodes.end()),
            std::vector<Index>(expected.begin(), expected.end()));
  ASSERT_EQ(body.surface_stored_nodes().size(), nodes.size());
  ASSERT_EQ(body.surface_rest_positions().size(), nodes.size());
  std::size_t held = 0;
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const auto node = static_cast<std::size_t>(nodes[s]);
    EXPECT_EQ(body.surface_rest_positions()[s], given.mesh.nodes[node] + given.rest_displacement[node]);
    EXPECT_EQ(body.surface_stored_nodes()[s], body.stored_node(nodes[s]));
    EXPECT_EQ(body.surface_stored_nodes()[s] < 0, given.fixed[node] != 0);
    if (given.fixed[node] != 0) ++held;
  }
  const int d = body.dimension(), along = GetParam() == ElementType::tet10 ? 5 : 3;
  EXPECT_EQ(held, d == 2 ? 3U : static_cast<std::size_t>(along * along));
}

TEST_P(SurfaceOf, LooksOutwards) {
  const Body body(test::unit_model(GetParam(), 2, Scope::surface, Precision::double_precision));
  const auto d = static_cast<std::size_t>(body.dimension());
  const Vec3 middle = d == 3 ? Vec3(0.5, 0.5, 0.5) : Vec3(0.5, 0.5, 0.0);
  ASSERT_EQ(body.surface_friction().size() * d, body.simplices().size());
  for (std::size_t at = 0; at < body.simplices().size(); at += d) {
    const auto x = [&](std::size_t corner) {
      return body.surface_rest_positions()[static_cast<std::size_t>(body.simplices()[at + corner])];
    };
    const Vec3 along = x(1) - x(0), across = d == 3 ? Vec3(x(2) - x(0)) : Vec3(0.0, 0.0, 1.0);
    EXPECT_GT(along.cross(across).dot(x(0) - middle), 0.0);
  }
}

TEST_P(SurfaceOf, HasTheFrictionOfTheElementUnderIt) {
  Model model = test::unit_model(GetParam(), 2, Scope::surface, Precision::double_precision);
  // Every element of a material of its own; the surface in an order of its own.
  model.materials.assign(static_cast<std::size_t>(model.mesh.elements()), model.materials[0]);
  for (std::size_t e = 0; e < model.materials.size(); ++e) {
    model.materials[e].friction = 0.01 * static_cast<double>(e);
    model.material_of_element[e] = static_cast<Index>(e);
  }
  const std::ptrdiff_t corners = model.dimension();
  std::rotate(model.surface.begin(), model.surface.begin() + 5 * corners, model.surface.end());
  const Body body(std::move(model));
  const Mesh& mesh = body.model().mesh;
  const auto d = static_cast<std::size_t>(body.dimension());
  for (std::size_t f = 0; f < body.surface_friction().size(); ++f) {
    const auto simplex = std::span(body.model().surface).subspan(f * d, d);
    std::vector<Index> owners;  // by plain search
    for (Index e = 0; e < mesh.elements(); ++e) {
      const auto nodes = mesh.element_nodes(e);
      if (std::all_of(simplex.begin(), simplex.end(),
                      [&](Index node) { return std::find(nodes.begin(), nodes.end(), node) != nodes.end(); }))
        owners.push_back(e);
    }
    ASSERT_EQ(owners.size(), 1U);
    EXPECT_EQ(body.surface_friction()[f], 0.01 * static_cast<double>(owners[0])) << "simplex " << f;
  }
}

TEST_P(SurfaceOf, OfTwoMaterialsHasTheFrictionOfTheOneBelow) {
  Model model = test::unit_model(GetParam(), 2, Scope::surface, Precision::double_precision);
  const int up = model.dimension() - 1;
  const auto height = [&model, up](std::span<const Index> nodes) {
    double sum = 0.0;
    for (const Index node : nodes) sum += model.mesh.nodes[static_cast<std::size_t>(node)][up];
    return sum / static_cast<double>(nodes.size());
  };
  model.materials.push_back(model.materials[0]);
  model.materials[1].friction = 0.25;
  for (Index e = 0; e < model.mesh.elements(); ++e)
    model.material_of_element[static_cast<std::size_t>(e)] =
        height(model.mesh.element_nodes(e)) > 0.5 ? 1 : 0;
  const Body body{Model(model)};
  const auto d = static_cast<std::size_t>(body.dimension());
  for (std::size_t f = 0; f < body.surface_friction().size(); ++f) {
    const bool upper = height(std::span(model.surface).subspan(f * d, d)) > 0.5;
    EXPECT_EQ(body.surface_friction()[f], upper ? 0.25 : 0.0);
  }
}

TEST_P(SurfaceOf, IsMadeOfSidesOfOneElement) {
  const Model good = test::unit_model(GetParam(), 2, Scope::surface, Precision::double_precision);
  const auto refused = [](Model model) {
    try {
      const Body body(std::move(model));
    } catch (const Error& error) {
      return error.where() + ": " + error.what();
    }
    return std::string();
  };
  const auto d = static_cast<std::size_t>(good.dimension());
  Model model = good;  // a simplex through the body, from the first node to the last
  model.surface[0] = static_cast<Index>(model.mesh.nodes.size()) - 1;
  const std::string text = refused(model);
  EXPECT_NE(text.find("box: the surface's"), std::string::npos) << text;
  EXPECT_NE(text.find("of nodes " + std::to_string(model.surface[0]) + ", "), std::string::npos) << text;

  model = good;  // a side between two elements
  const auto sides = sorted_sides(model.mesh);
  const auto inner =
      std::adjacent_find(sides.begin(), sides.end(),
                         [](const ElementSide& a, const ElementSide& b) { return a.corners == b.corners; });
  ASSERT_NE(inner, sides.end());
  const std::vector<Index> nodes = side_nodes(model.mesh, *inner);
  std::copy_n(nodes.begin(), d, model.surface.begin());
  EXPECT_NE(refused(model).find("exactly one element"), std::string::npos);

  model = good;  // a mesh without elements
  model.mesh.connectivity.clear();
  model.material_of_element.clear();
  EXPECT_NE(refused(model).find("exactly one element"), std::string::npos);
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

  for (const bool too_few : {true, false}) {
    model = good;
    if (too_few)
      model.material_of_element.pop_back();
    else
      model.material_of_element.back() = 1;
    try {
      const Body body(std::move(model));
      FAIL();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("and 1 materials"), std::string::npos) << error.what();
    }
  }
}

// All nodes that move are in one group each, with neighbours of its first one.
TEST(SurfaceAggregates, HaveEachNodeThatMovesOnce) {
  for (const int d : {2, 3}) {
    const Body body(test::unit_model(d, d == 3 ? 6 : 16, Scope::surface, Precision::double_precision));
    const SurfaceAggregates& groups = body.aggregates();
    std::vector<int> seen(body.surface_rest_positions().size(), 0);
    std::vector<std::set<Index>> beside(seen.size());
    const auto corners = static_cast<std::size_t>(d);
    for (std::size_t at = 0; at < body.simplices().size(); ++at) {
      const std::size_t first = at / corners * corners;
      for (std::size_t k = 0; k < corners; ++k)
        beside[static_cast<std::size_t>(body.simplices()[at])].insert(body.simplices()[first + k]);
    }
    for (Index group = 0; group < groups.count(); ++group) {
      const std::span<const Index> members = groups.members(group);
      EXPECT_LE(std::ssize(members), groups.most_members());
      for (const Index member : members) {
        ++seen[static_cast<std::size_t>(member)];
        EXPECT_EQ(groups.of_node(member), group);
        const bool touches = std::any_of(members.begin(), members.end(), [&](Index other) {
          return other != member && beside[static_cast<std::size_t>(member)].count(other) > 0;
        });
        EXPECT_TRUE(touches || members.size() == 1);
      }
    }
    for (std::size_t node = 0; node < seen.size(); ++node)
      EXPECT_EQ(seen[node], body.surface_moves(static_cast<Index>(node)) ? 1 : 0) << node;
    EXPECT_GT(static_cast<double>(seen.size()), (d == 3 ? 5.0 : 2.0) * groups.count()) << "they are large";
  }
}

// A surface that overlays refine has none: their nodes follow several of the body's.
TEST(SurfaceAggregates, AreNotOfARefinedSurface) {
  const Body body(test::unit_model(2, 8, Scope::surface, Precision::double_precision), {}, 2);
  EXPECT_EQ(body.aggregates().count(), 0);
}

// Two runs are beside each other where a simplex has nodes of both.
TEST(NodeRuns, LieBesideThoseThatShareSimplices) {
  // Five nodes in a row, joined to triangles in turn; node 4 follows nothing.
  const std::vector<Index> simplices = {0, 1, 2, 1, 2, 3, 2, 3, 4};
  const std::vector<Index> stored = {0, 1, 4, 5, -1};
  const NodeRuns runs(2, 7, 3, simplices, stored);
  ASSERT_EQ(runs.count(), 4) << "the last has one node";
  EXPECT_EQ(runs.of(5), 2);
  EXPECT_EQ(runs.begin(3), 6);
  EXPECT_EQ(runs.end(3), 7);
  const auto beside = [&](Index run) {
    return std::vector<Index>(runs.beside(run).begin(), runs.beside(run).end());
  };
  EXPECT_EQ(beside(0), std::vector<Index>{2});
  EXPECT_EQ(beside(1), std::vector<Index>{});
  EXPECT_EQ(beside(2), std::vector<Index>{0});
}

}  // namespace
}  // namespace palpate::body_test
