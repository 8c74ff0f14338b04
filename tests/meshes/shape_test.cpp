// Generated bodies, and the same bodies in other kinds of elements.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "meshes/check.h"
#include "meshes/element.h"
#include "meshes/quality.h"
#include "meshes/surface.h"
#include "tests/support/bodies/meshes_bodies.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::shape_test {
namespace {

using std::numbers::pi;
using test::contains;
using test::error_of;
using test::node_of;

double volume_of(const Mesh& mesh) {
  double volume = 0.0;
  for (Index e = 0; e < mesh.elements(); ++e) volume += element_volume(mesh.element, element_nodes(mesh, e));
  return volume;
}

TEST(Shapes, EveryKindFillsTheBlockWithPositiveElements) {
  for (const ElementType type : body_elements) {
    SCOPED_TRACE(traits(type).name);
    const Mesh mesh = test::block(type);
    EXPECT_EQ(mesh.element, type);
    EXPECT_EQ(mesh.regions, std::vector<Index>(static_cast<std::size_t>(mesh.elements()), 0));
    EXPECT_NEAR(volume_of(mesh), test::block_volume(type), 1e-15);
    for (Index e = 0; e < mesh.elements(); ++e) {
      EXPECT_GT(smallest_determinant(type, element_nodes(mesh, e)), 0.0);
    }
  }
}

TEST(BoxMesh, OneCellIsSixTetrahedraAlongTheDiagonal) {
  const Mesh mesh = generate(BoxShape{});
  ASSERT_EQ(mesh.nodes.size(), 8u);
  for (int node = 0; node < 8; ++node) {  // x fastest, then y, then z
    EXPECT_EQ(node_of(mesh, node), Vec3(node & 1, (node >> 1) & 1, node >> 2));
  }
  ASSERT_EQ(mesh.elements(), 6);
  for (Index e = 0; e < 6; ++e) {
    const auto tet = mesh.element_nodes(e);
    EXPECT_EQ(std::count(tet.begin(), tet.end(), 0), 1);
    EXPECT_EQ(std::count(tet.begin(), tet.end(), 7), 1);
    EXPECT_NEAR(element_volume(ElementType::tet4, element_nodes(mesh, e)), 1.0 / 6.0, 1e-15);
  }
}

TEST(BoxMesh, OneHexahedronHasItsCornersInVtksOrder) {
  const Mesh mesh = generate(BoxShape{}, ElementType::hex8);
  EXPECT_EQ(mesh.connectivity, (std::vector<Index>{0, 1, 3, 2, 4, 5, 7, 6}));
}

TEST(BoxMesh, PlaceSizeAndNumbers) {
  for (const ElementType type : {ElementType::tet4, ElementType::hex8}) {
    const Mesh mesh = generate(BoxShape{Vec3(-1, 2, 0.5), Vec3(0.3, 0.2, 0.7), {3, 2, 5}}, type);
    EXPECT_EQ(mesh.nodes.size(), 4u * 3u * 6u);
    EXPECT_EQ(mesh.elements(), (type == ElementType::hex8 ? 1 : 6) * 3 * 2 * 5);
    EXPECT_LT((mesh.nodes.front() - Vec3(-1, 2, 0.5)).norm(), 1e-15);
    EXPECT_LT((mesh.nodes.back() - Vec3(-0.7, 2.2, 1.2)).norm(), 1e-15);
  }
}

TEST(Rectangle, PlaceSizeAndRisingDiagonals) {
  const RectangleShape shape{Vec3(-1, 2, 7), Vec3(0.3, 0.2, 9), {3, 2}};
  const Mesh quads = generate(shape), triangles = generate(shape, ElementType::tri3);
  EXPECT_EQ(quads.nodes, triangles.nodes);
  ASSERT_EQ(quads.nodes.size(), 12u);
  EXPECT_EQ(quads.nodes.front(), Vec3(-1, 2, 0));
  EXPECT_LT((quads.nodes.back() - Vec3(-0.7, 2.2, 0)).norm(), 1e-15);
  EXPECT_LT((quads.nodes[5] - Vec3(-0.9, 2.1, 0)).norm(), 1e-15);  // x fastest
  ASSERT_EQ(quads.elements(), 6);
  const auto first = quads.element_nodes(0);
  EXPECT_EQ(std::vector<Index>(first.begin(), first.end()), (std::vector<Index>{0, 1, 5, 4}));
  ASSERT_EQ(triangles.elements(), 12);
  EXPECT_EQ(std::vector<Index>(triangles.connectivity.begin(), triangles.connectivity.begin() + 6),
            (std::vector<Index>{0, 1, 5, 0, 5, 4}));
}

TEST(Shapes, KindsThatAShapeIsNotMadeOfAreRefused) {
  EXPECT_TRUE(contains(error_of([] { generate(BoxShape{}, ElementType::tri3); }).what(), "tri3"));
  EXPECT_TRUE(contains(error_of([] { generate(RectangleShape{}, ElementType::hex8); }).what(), "hex8"));
}

TEST(Cylinder, IsThePrismOverARegularPolygon) {
  const CylinderShape shape{0.05, 0.2, 8, 5};
  const Mesh mesh = generate(shape);
  const double corners = 4.0 * shape.cells_across;
  const double volume = 0.5 * corners * std::sin(2 * pi / corners) * 0.05 * 0.05 * 0.2;
  EXPECT_NEAR(volume_of(mesh), volume, 1e-12 * volume);
  EXPECT_EQ(extract_surface(mesh).count(), 2 * 32 * 5 + 2 * 2 * 64);  // any more would be a gap inside
  for (const Vec3& x : mesh.nodes) {
    EXPECT_LE(x.head<2>().norm(), 0.05 * (1 + 1e-14));
    EXPECT_GE(x.z(), 0.0);
    EXPECT_LE(x.z(), 0.2 * (1 + 1e-14));
  }
}

TEST(Sphere, NodesAreOnItAndTheVolumeConvergesAtSecondOrder) {
  const double radius = 0.03, exact = 4.0 / 3.0 * pi * radius * radius * radius;
  double last_error = 0.0;
  for (const int cells : {4, 8, 16}) {
    const Mesh mesh = generate(SphereShape{radius, cells});
    const Surface surface = extract_surface(mesh);
    EXPECT_EQ(surface.count(), 12 * cells * cells);
    for (const Index node : surface.nodes) EXPECT_NEAR(node_of(mesh, node).norm(), radius, 1e-15);
    const double error = exact - volume_of(mesh);
    EXPECT_GT(error, 0.0);
    if (last_error > 0.0) {
      EXPECT_NEAR(last_error / error, 4.0, 0.2);
    }
    last_error = error;
  }
}

/// Angles stay away from 0 and 180 degrees however fine the grid is.
TEST(Shapes, BentElementsAreWellShapedAtEveryRefinement) {
  for (const int cells : {2, 4, 8, 16}) {
    Mesh cylinder = generate(CylinderShape{1.0, 2.0, cells, cells}),
         sphere = generate(SphereShape{1.0, cells});
    EXPECT_EQ(orient_elements(cylinder, ""), 0u);
    EXPECT_EQ(orient_elements(sphere, ""), 0u);
    for (const Mesh* mesh : {&cylinder, &sphere}) {
      const QualityReport report = measure_quality(*mesh);
      EXPECT_GT(report.min_angle, 28.0);
      EXPECT_LT(report.max_angle, 122.0);
      EXPECT_GT(report.min_shape, 0.6);
    }
  }
}

Mesh tagged_box() {
  Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(3, 2, 4), {3, 2, 4}});
  mesh.tagged_facets = {0, 1, 5, 0, 5, 4};  // on z = 0
  mesh.facet_tags = {7, 8};
  mesh.regions[3] = 5;
  return mesh;
}

/// The middles of Kuhn's edges are the points of the grid of half the spacing.
TEST(WithElements, SecondOrderAddsOneNodeInTheMiddleOfEachEdge) {
  const Mesh linear = tagged_box(), quadratic = with_elements(linear, ElementType::tet10, "");
  EXPECT_EQ(quadratic.element, ElementType::tet10);
  EXPECT_EQ(quadratic.elements(), linear.elements());
  EXPECT_EQ(quadratic.regions, linear.regions);
  ASSERT_EQ(quadratic.nodes.size(), 7u * 5u * 9u);
  EXPECT_TRUE(std::equal(linear.nodes.begin(), linear.nodes.end(), quadratic.nodes.begin()));
  std::set<std::array<long, 3>> places;
  for (const Vec3& x : quadratic.nodes) {
    places.insert({std::lround(2 * x.x()), std::lround(2 * x.y()), std::lround(2 * x.z())});
    EXPECT_EQ(Vec3((2.0 * x).array().round() - 2.0 * x.array()), Vec3::Zero());
  }
  EXPECT_EQ(places.size(), quadratic.nodes.size());
  const int edges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};  // VTK's order
  for (Index e = 0; e < quadratic.elements(); ++e) {
    const ElementNodes x = element_nodes(quadratic, e);
    EXPECT_EQ(x.topRows(4), element_nodes(linear, e));
    for (int i = 0; i < 6; ++i) EXPECT_EQ(x.row(4 + i), (x.row(edges[i][0]) + x.row(edges[i][1])) / 2);
  }
}

TEST(WithElements, TaggedFacetsFollow) {
  const Mesh quadratic = with_elements(tagged_box(), ElementType::tet10, "");
  EXPECT_EQ(quadratic.facet_tags, (std::vector<Index>{7, 8}));
  ASSERT_EQ(quadratic.tagged_facets.size(), 12u);
  for (Index t = 0; t < 2; ++t) {
    const auto facet = quadratic.tagged_facet(t);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(node_of(quadratic, facet[3 + i]),
                Vec3((node_of(quadratic, facet[i]) + node_of(quadratic, facet[(i + 1) % 3])) / 2));
    }
  }
  EXPECT_EQ(quadratic.tagged_facet(0)[2], 5);
}

TEST(WithElements, BackToFirstOrderIsTheSameMesh) {
  const Mesh before = tagged_box();
  Mesh quadratic = with_elements(before, ElementType::tet10, "");
  // As files may have it: middles between the corners. The last node is a middle, the first a corner.
  const auto last = static_cast<Index>(quadratic.nodes.size()) - 1;
  std::swap(quadratic.nodes.front(), quadratic.nodes.back());
  for (auto* list : {&quadratic.connectivity, &quadratic.tagged_facets}) {
    for (Index& node : *list) node = node == 0 ? last : node == last ? 0 : node;
  }
  const Mesh after = with_elements(quadratic, ElementType::tet4, "");
  EXPECT_EQ(after.element, ElementType::tet4);
  ASSERT_EQ(after.nodes.size(), before.nodes.size());
  EXPECT_EQ(after.regions, before.regions);
  EXPECT_EQ(after.facet_tags, before.facet_tags);
  for (std::size_t i = 0; i < before.connectivity.size(); ++i) {
    EXPECT_EQ(node_of(after, after.connectivity[i]), node_of(before, before.connectivity[i]));
  }
  for (std::size_t i = 0; i < before.tagged_facets.size(); ++i) {
    EXPECT_EQ(node_of(after, after.tagged_facets[i]), node_of(before, before.tagged_facets[i]));
  }
}

TEST(WithElements, ItsOwnKindIsLeftAsItIsAndOtherPairsAreRefused) {
  for (const ElementType has : body_elements) {
    const Mesh mesh = test::block(has);
    for (const ElementType wanted : body_elements) {
      const bool tets = traits(has).corners == 4 && traits(wanted).corners == 4 &&
                        traits(has).dimension == 3 && traits(wanted).dimension == 3;
      if (has == wanted) {
        EXPECT_EQ(with_elements(mesh, wanted, "").connectivity, mesh.connectivity);
      } else if (!tets) {
        const Error error = error_of([&] { with_elements(mesh, wanted, "model.toml"); });
        EXPECT_TRUE(contains(error.what(), traits(has).name)) << error.what();
        EXPECT_TRUE(contains(error.what(), traits(wanted).name)) << error.what();
        EXPECT_EQ(error.where(), "model.toml");
      }
    }
  }
}

}  // namespace
}  // namespace palpate::shape_test
