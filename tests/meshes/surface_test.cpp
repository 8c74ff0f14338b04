// Boundaries of meshes of every kind.
#include "meshes/surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "tests/support/bodies/meshes_bodies.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::surface_test {
namespace {

using test::contains;
using test::error_of;
using test::node_of;

/// Volume inside the surface by the divergence theorem; in the plane, area inside the lines.
double enclosed_volume(const Mesh& mesh, const std::vector<Index>& simplices) {
  const auto d = static_cast<std::size_t>(mesh.dimension());
  double volume = 0.0;
  for (std::size_t s = 0; s < simplices.size(); s += d) {
    const Vec3 &a = node_of(mesh, simplices[s]), &b = node_of(mesh, simplices[s + 1]);
    if (d == 2) {
      volume += 0.5 * (a.x() * b.y() - a.y() * b.x());
    } else {
      volume += a.dot(b.cross(node_of(mesh, simplices[s + 2]))) / 6.0;
    }
  }
  return volume;
}

/// Every edge of a closed oriented surface is passed once in each direction; every node of closed lines is
/// left once and reached once.
bool is_closed(const std::vector<Index>& simplices, std::size_t corners) {
  std::map<std::pair<Index, Index>, int> passes;
  for (std::size_t s = 0; s < simplices.size(); s += corners) {
    if (corners == 2) {
      ++passes[{simplices[s], 1}];
      ++passes[{simplices[s + 1], -1}];
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) ++passes[{simplices[s + i], simplices[s + (i + 1) % 3]}];
  }
  return std::all_of(passes.begin(), passes.end(), [&](const auto& pass) {
    const auto& [ends, count] = pass;
    const std::pair<Index, Index> back =
        corners == 2 ? std::pair{ends.first, -ends.second} : std::pair{ends.second, ends.first};
    return count == 1 && passes.contains(back);
  });
}

TEST(Surface, EveryKindEnclosesTheBlock) {
  const struct {
    ElementType type;
    ElementType facet;
    Index facets;
    std::size_t nodes, simplices;
  } cases[] = {{ElementType::tri3, ElementType::line2, 12, 12, 12},
               {ElementType::quad4, ElementType::line2, 12, 12, 12},
               {ElementType::tet4, ElementType::tri3, 80, 42, 80},     // 5 x 3 x 3 nodes, 3 of them inside
               {ElementType::tet10, ElementType::tri6, 80, 162, 320},  // 9 x 5 x 5 nodes, 63 of them inside
               {ElementType::hex8, ElementType::quad4, 40, 42, 80}};
  for (const auto& c : cases) {
    SCOPED_TRACE(traits(c.type).name);
    const Mesh mesh = test::block(c.type);
    const Surface surface = extract_surface(mesh);
    EXPECT_EQ(surface.facet, c.facet);
    EXPECT_EQ(surface.count(), c.facets);
    EXPECT_EQ(surface.nodes.size(), c.nodes);
    EXPECT_TRUE(std::is_sorted(surface.nodes.begin(), surface.nodes.end()));
    const bool solid = mesh.dimension() == 3;
    const Vec3 middle(0.2, 0.1, solid ? 0.1 : 0.0), half(0.2, 0.1, solid ? 0.1 : 1.0);
    for (const Index node : surface.nodes) {
      const Vec3 to_boundary = half - (node_of(mesh, node) - middle).cwiseAbs();
      EXPECT_LT(to_boundary.minCoeff(), 1e-15);
    }
    const auto d = static_cast<std::size_t>(mesh.dimension());
    const std::vector<Index> simplices = surface_simplices(surface);
    ASSERT_EQ(simplices.size(), d * c.simplices);
    EXPECT_TRUE(is_closed(simplices, d));
    EXPECT_NEAR(enclosed_volume(mesh, simplices), test::block_volume(c.type), 1e-15);
  }
}

/// Outward, and the middles of a facet of second order in the order of its corners.
TEST(Surface, EachFacetLooksOutwards) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    const Mesh mesh = test::block(type);
    const Surface surface = extract_surface(mesh);
    const Vec3 middle(0.2, 0.1, mesh.dimension() == 3 ? 0.1 : 0.0);
    for (Index f = 0; f < surface.count(); ++f) {
      const auto nodes = surface.facet_nodes(f);
      const Vec3 &a = node_of(mesh, nodes[0]), &b = node_of(mesh, nodes[1]);
      const Vec3 normal = mesh.dimension() == 2 ? Vec3((b - a).cross(Vec3::UnitZ()))  // right of the line
                                                : Vec3((b - a).cross(node_of(mesh, nodes[2]) - a));
      EXPECT_GT(normal.dot(a - middle), 0.0);
      if (surface.facet != ElementType::tri6) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 between = (node_of(mesh, nodes[i]) + node_of(mesh, nodes[(i + 1) % 3])) / 2;
        EXPECT_LT((node_of(mesh, nodes[3 + i]) - between).norm(), 1e-16);
      }
    }
  }
}

TEST(Surface, AHexahedronsFacetsGoRoundTheirSquares) {
  const Mesh mesh = generate(BoxShape{}, ElementType::hex8);
  const Surface surface = extract_surface(mesh);
  ASSERT_EQ(surface.count(), 6);
  for (Index f = 0; f < 6; ++f) {
    const auto nodes = surface.facet_nodes(f);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ((node_of(mesh, nodes[i]) - node_of(mesh, nodes[(i + 1) % 4])).norm(), 1.0);
    }
  }
}

/// A node inside is as many elements deep as cells are above it.
TEST(Surface, LayersCountElementsFromTheSurface) {
  const int m = 6;
  const BoxShape box{Vec3::Zero(), Vec3::Constant(m), {m, m, m}};
  const RectangleShape rectangle{Vec3::Zero(), Vec3(m, m, 0), {m, m}};
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    const Mesh mesh = traits(type).dimension == 2  ? generate(rectangle, type)
                      : type == ElementType::tet10 ? with_elements(generate(box), type, "")
                                                   : generate(box, type);
    const std::vector<Index> layers = layers_below_surface(mesh, extract_surface(mesh));
    for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
      const auto x = mesh.nodes[node].head(mesh.dimension());
      const double depth = std::min(x.minCoeff(), m - x.maxCoeff());
      EXPECT_EQ(layers[node], std::lround(std::ceil(depth))) << mesh.nodes[node].transpose();
    }
  }
}

TEST(Surface, OverlappingElementsAreRefused) {
  Mesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}, {0, 0, 2}};
  mesh.connectivity = {0, 1, 2, 3, 0, 2, 1, 4};
  EXPECT_EQ(extract_surface(mesh).count(), 6);
  mesh.connectivity = {0, 1, 2, 3, 0, 2, 1, 4, 0, 1, 2, 5};
  const Error three = error_of([&] { extract_surface(mesh); });
  EXPECT_TRUE(contains(three.what(), "3 elements share the face of nodes 0, 1, 2")) << three.what();
  mesh.connectivity = {0, 1, 2, 3, 0, 1, 2, 5};
  const Error overlap = error_of([&] { extract_surface(mesh); });
  EXPECT_TRUE(contains(overlap.what(), "same side of the face of nodes 0, 1, 2")) << overlap.what();
}

TEST(Surface, AnElementThatStandsTwiceIsRefusedInEveryKind) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    Mesh mesh = test::block(type);
    const auto first = mesh.element_nodes(0);
    const std::vector<Index> copy(first.begin(), first.end());
    Mesh alone = mesh;
    alone.connectivity = copy;
    EXPECT_EQ(extract_surface(alone).count(), traits(type).facets);
    alone.connectivity.insert(alone.connectivity.end(), copy.begin(), copy.end());
    EXPECT_TRUE(contains(error_of([&] { extract_surface(alone); }).what(), "overlap"));
    mesh.connectivity.insert(mesh.connectivity.end(), copy.begin(), copy.end());
    const Error error = error_of([&] { extract_surface(mesh); });
    EXPECT_TRUE(contains(error.what(), "overlap") || contains(error.what(), "share")) << error.what();
    EXPECT_FALSE(error.hint().empty());
  }
}

TEST(Surface, ElementsThatDoNotShareTheirMiddlesAreRefused) {
  Mesh mesh = test::block(ElementType::tet10);
  const Index middle = mesh.connectivity[4];
  mesh.nodes.push_back(node_of(mesh, middle));
  mesh.connectivity[4] = static_cast<Index>(mesh.nodes.size()) - 1;
  const Error error = error_of([&] { extract_surface(mesh); });
  EXPECT_TRUE(contains(error.what(), "not the middles")) << error.what();
}

}  // namespace
}  // namespace palpate::surface_test
