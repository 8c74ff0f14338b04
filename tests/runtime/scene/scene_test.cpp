// What a viewer draws, against areas and counts that are known.
#include "runtime/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "runtime/body/patch_maker.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::scene_test {
namespace {

using Triangles = std::vector<std::array<Index, 3>>;
using Edge = std::pair<Index, Index>;

double area(const std::vector<Vec3>& nodes, const std::array<Index, 3>& triangle) {
  const Vec3& a = nodes[static_cast<std::size_t>(triangle[0])];
  const Vec3& b = nodes[static_cast<std::size_t>(triangle[1])];
  const Vec3& c = nodes[static_cast<std::size_t>(triangle[2])];
  return 0.5 * (b - a).cross(c - a).norm();
}

double area(const std::vector<Vec3>& nodes, const Triangles& triangles) {
  double sum = 0.0;
  for (const auto& triangle : triangles) sum += area(nodes, triangle);
  return sum;
}

/// Six times the volume over 6: positive when the triangles look outwards.
double volume(const std::vector<Vec3>& nodes, const Triangles& triangles) {
  double sum = 0.0;
  for (const auto& t : triangles) {
    sum += nodes[static_cast<std::size_t>(t[0])].dot(
               nodes[static_cast<std::size_t>(t[1])].cross(nodes[static_cast<std::size_t>(t[2])])) /
           6.0;
  }
  return sum;
}

/// How often triangles run along each edge, forwards and backwards.
std::map<Edge, int> directed_edges(const Triangles& triangles) {
  std::map<Edge, int> count;
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++count[{t[k], t[(k + 1) % 3]}];
  }
  return count;
}

std::shared_ptr<const Patch> patch_at_top(const Body& body, int rings) {
  const Vec3 top = test::top_middle(body.dimension());
  const Index centre = body.nearest_surface_node(top).node;
  return PatchMaker(body, rings).make({&centre, 1});
}

Body cube(ElementType element, int cells, int refinement = 1) {
  return Body(test::unit_model(element, cells, Scope::full, Precision::double_precision), {}, refinement);
}

TEST(Scene, CubeIsClosedLooksOutwardsAndHasItsEdges) {
  struct Expected {
    ElementType element;
    std::size_t nodes, triangles, edges;
  };
  // n = 3 cells an edge: 6 n^2 + 2 nodes on a cube's surface; each face of a cell is 2 triangles (8 of
  // tet10's middles). Edges by Euler, V - E + F = 2: 12 n^2 of squares, 18 n^2 of triangles, halved by the
  // middles.
  for (const Expected& expected :
       {Expected{ElementType::hex8, 56, 108, 108}, Expected{ElementType::tet4, 56, 108, 162},
        Expected{ElementType::tet10, 218, 432, 324}}) {
    const Body body = cube(expected.element, 3);
    const Scene scene = make_scene(body, 7);
    SCOPED_TRACE(traits(expected.element).name);
    EXPECT_EQ(scene.number, 7U);
    EXPECT_EQ(scene.dimension, 3);
    EXPECT_FALSE(scene.is_plane);
    EXPECT_EQ(scene.nodes.size(), expected.nodes);
    EXPECT_EQ(scene.held.size(), expected.nodes);
    EXPECT_EQ(scene.triangles.size(), expected.triangles);
    EXPECT_EQ(scene.elements.size(), expected.triangles);
    EXPECT_EQ(scene.edges.size(), expected.edges);
    const std::set<std::array<Index, 2>> once(scene.edges.begin(), scene.edges.end());
    EXPECT_EQ(once.size(), scene.edges.size());
    EXPECT_NEAR(area(scene.nodes, scene.triangles), 6.0, 1e-12);
    EXPECT_NEAR(volume(scene.nodes, scene.triangles), 1.0, 1e-12);
    for (const auto& [edge, count] : directed_edges(scene.triangles)) {
      EXPECT_EQ(count, 1);
      EXPECT_TRUE(directed_edges(scene.triangles).contains({edge.second, edge.first}));
      if (HasFailure()) return;
    }
    for (std::size_t k = 0; k < scene.nodes.size(); ++k) {
      EXPECT_EQ(scene.held[k], scene.nodes[k].z() < 1e-9 ? 7 : 0);
      // The first of the nodes that pictures have.
      EXPECT_EQ(scene.nodes[k], body.surface_in_mesh()[k]);
    }
  }
}

class ScenePatches : public testing::TestWithParam<ElementType> {};

INSTANTIATE_TEST_SUITE_P(Elements, ScenePatches,
                         testing::Values(ElementType::hex8, ElementType::tet4, ElementType::tet10));

TEST_P(ScenePatches, TakeThePlaceOfWhatTheyHide) {
  constexpr int refinement = 3;
  const Body body = cube(GetParam(), 4, refinement);
  const Scene scene = make_scene(body, 1);
  const auto patch = patch_at_top(body, 1);
  ASSERT_FALSE(patch->elements().empty());
  ASSERT_TRUE(std::is_sorted(patch->elements().begin(), patch->elements().end()));
  const ScenePatch drawn = make_scene_patch(body, scene, *patch);

  ASSERT_EQ(drawn.nodes.size(), patch->surface_nodes().size());
  ASSERT_TRUE(std::is_sorted(drawn.hidden.begin(), drawn.hidden.end()));
  Triangles hidden;
  for (const Index t : drawn.hidden) hidden.push_back(scene.triangles[static_cast<std::size_t>(t)]);
  ASSERT_FALSE(hidden.empty());
  EXPECT_LT(hidden.size(), scene.triangles.size());
  EXPECT_EQ(drawn.triangles.size(), refinement * refinement * hidden.size());
  EXPECT_NEAR(area(drawn.nodes, drawn.triangles), area(scene.nodes, hidden), 1e-12);

  // Both are bounded by the same line: as long, and each node of the finer one on the top of the cube.
  const auto length = [](const std::vector<Vec3>& nodes, const auto& edges) {
    double sum = 0.0;
    for (const auto& [a, b] : edges)
      sum += (nodes[static_cast<std::size_t>(a)] - nodes[static_cast<std::size_t>(b)]).norm();
    return sum;
  };
  const std::map<Edge, int> directed = directed_edges(hidden);
  std::set<Edge> rim;
  for (const auto& [edge, count] : directed) {
    if (!directed.contains({edge.second, edge.first})) rim.insert(edge);
  }
  EXPECT_NEAR(length(drawn.nodes, drawn.outline), length(scene.nodes, rim), 1e-12);
  EXPECT_EQ(drawn.outline.size(), refinement * rim.size());
  for (const auto& triangle : drawn.triangles) {
    for (const Index node : triangle)
      EXPECT_NEAR(drawn.nodes[static_cast<std::size_t>(node)].z(), 1.0, 1e-12);
  }
}

TEST(Scene, MaterialsMeetInAPlane) {
  for (const ElementType element : {ElementType::tet4, ElementType::tet10, ElementType::hex8}) {
    const Body body(test::two_materials(element, 2), {}, 2);
    const Scene scene = make_scene(body, 1);
    ASSERT_EQ(scene.materials.size(), scene.triangles.size());
    EXPECT_NEAR(area(scene.inner.nodes, scene.inner.triangles), 1.0, 1e-12);
    for (const Vec3& node : scene.inner.nodes) EXPECT_NEAR(node.z(), 0.5, 1e-12);
    for (std::size_t t = 0; t < scene.inner.triangles.size(); ++t) {
      const auto& [a, b, c] = scene.inner.triangles[t];
      const std::vector<Vec3>& nodes = scene.inner.nodes;
      const double up = (nodes[b] - nodes[a]).cross(nodes[c] - nodes[a]).z();
      EXPECT_EQ(scene.inner.inside[t], up > 0.0 ? 1 : 0);  // below is the second material
      EXPECT_EQ(scene.inner.outside[t], up > 0.0 ? 0 : 1);
    }
    for (std::size_t t = 0; t < scene.triangles.size(); ++t) {
      const auto& nodes = scene.triangles[t];
      const double height = (scene.nodes[nodes[0]] + scene.nodes[nodes[1]] + scene.nodes[nodes[2]]).z() / 3.0;
      EXPECT_EQ(scene.materials[t], height < 0.5 ? 1 : 0);
    }
    const ScenePatch patch = make_scene_patch(body, scene, *patch_at_top(body, 1));
    EXPECT_EQ(patch.materials.size(), patch.triangles.size());
  }
  EXPECT_TRUE(make_scene(cube(ElementType::tet4, 2), 1).materials.empty());
}

TEST(Scene, PlateShowsItsElementsWhereAllIsStored) {
  for (const ElementType element : {ElementType::quad4, ElementType::tri3}) {
    SCOPED_TRACE(traits(element).name);
    const Scene scene = make_scene(cube(element, 4), 1);
    EXPECT_TRUE(scene.is_plane);
    EXPECT_EQ(scene.dimension, 2);
    EXPECT_EQ(scene.nodes.size(), 25U);
    EXPECT_EQ(scene.surface_nodes.size(), 16U);
    EXPECT_EQ(scene.triangles.size(), 32U);
    EXPECT_EQ(scene.edges.size(), element == ElementType::quad4 ? 40U : 56U);
    EXPECT_NEAR(area(scene.nodes, scene.triangles), 1.0, 1e-12);
    for (const Index node : scene.surface_nodes) {
      const Vec3& x = scene.nodes[static_cast<std::size_t>(node)];
      EXPECT_NEAR(std::min({x.x(), x.y(), 1.0 - x.x(), 1.0 - x.y()}), 0.0, 1e-12);
    }
  }
}

TEST(Scene, PlateShowsItsBoundaryWhereTheInteriorIsUnknown) {
  const Body body(test::unit_model(ElementType::quad4, 4, Scope::surface, Precision::double_precision));
  const Scene scene = make_scene(body, 1);
  EXPECT_FALSE(scene.is_plane);
  EXPECT_EQ(scene.nodes.size(), 16U);
  EXPECT_TRUE(scene.triangles.empty());
  EXPECT_EQ(scene.edges.size(), 16U);
}

TEST(Scene, PatchOfAPlateIsItsFineBoundary) {
  const Body body = cube(ElementType::quad4, 4, 3);
  const ScenePatch drawn = make_scene_patch(body, make_scene(body, 1), *patch_at_top(body, 1));
  EXPECT_TRUE(drawn.hidden.empty());
  EXPECT_TRUE(drawn.triangles.empty());
  EXPECT_EQ(drawn.outline.size(), 6U);  // two cells of the top
  double length = 0.0;
  for (const auto& [a, b] : drawn.outline)
    length += (drawn.nodes[static_cast<std::size_t>(a)] - drawn.nodes[static_cast<std::size_t>(b)]).norm();
  EXPECT_NEAR(length, 0.5, 1e-12);
}

TEST(Scene, OfARecordingHasAllItsSurface) {
  const Body body = cube(ElementType::tet4, 2, 2);
  RecordedSurface recorded = recorded_surface(body);
  const Scene scene = make_scene(recorded, 3);
  EXPECT_EQ(scene.number, 3U);
  EXPECT_EQ(scene.nodes.size(), recorded.nodes.size());
  for (std::size_t k = 0; k < scene.nodes.size(); ++k)
    EXPECT_EQ(scene.held[k], scene.nodes[k].z() == 0.0 ? 7 : 0) << "the cube stands on what is held";
  recorded.held.clear();  // of a recording before 4.1
  EXPECT_EQ(make_scene(recorded, 3).held, std::vector<std::uint8_t>(recorded.nodes.size(), 0));
  EXPECT_NEAR(volume(scene.nodes, scene.triangles), 1.0, 1e-12);
  EXPECT_EQ(scene.edges.size(), scene.triangles.size() * 3 / 2);
  EXPECT_EQ(make_scene(recorded_surface(cube(ElementType::quad4, 2)), 1).edges.size(), 8U);
}

}  // namespace
}  // namespace palpate::scene_test
