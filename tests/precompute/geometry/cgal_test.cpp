// Surfaces meshed anew by CGAL.
#include <gtest/gtest.h>

#include <numbers>

#include "meshes/check.h"
#include "meshes/quality.h"
#include "meshes/surface.h"
#include "precompute/geometry/cgal_surface_mesh.h"
#include "precompute/geometry/mesh_parts.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::cgal_test {
namespace {

using testing::at;
using testing::ball;
using testing::error_of;
using testing::expect_mentions;
using testing::volume;

MeshOptions edges(double length) {
  MeshOptions options;
  options.mesher = Mesher::cgal;
  options.edge_length = length;
  return options;
}

bool is_node(const Mesh& mesh, const Vec3& x) {
  return std::any_of(mesh.nodes.begin(), mesh.nodes.end(),
                     [&](const Vec3& node) { return (node - x).norm() < 1e-12; });
}

/// Number of the boundary's edges that lie on an edge of the cube [0, s]^3, and their length.
std::pair<int, double> kept_edges(const Mesh& mesh, double s) {
  const Surface surface = extract_surface(mesh);
  const auto faces = [&](const Vec3& x) {  // bit i: on the face at 0, bit 3 + i: at s
    unsigned bits = 0;
    for (int i = 0; i < 3; ++i) {
      bits |= (std::abs(x[i]) < 1e-9 ? 1U : 0U) << i | (std::abs(x[i] - s) < 1e-9 ? 1U : 0U) << (3 + i);
    }
    return bits;
  };
  int count = 0;
  double length = 0.0;
  for (Index f = 0; f < surface.count(); ++f) {
    const auto nodes = surface.facet_nodes(f);
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 &a = mesh.nodes[at(nodes[i])], &b = mesh.nodes[at(nodes[(i + 1) % 3])];
      if (std::popcount(faces(a) & faces(b)) >= 2) {
        ++count;
        length += (a - b).norm();
      }
    }
  }
  return {count / 2, length / 2.0};  // each edge has two facets
}

TEST(CgalSurface, SharpEdgesAreKept) {
  const TriangleSurface cube = testing::cube(2.0);
  Mesh kept = mesh_surface_with_cgal(cube, edges(0.4), "cube");
  EXPECT_NEAR(volume(kept), 8.0, 1e-9);
  for (const Vec3& x : cube.nodes) {
    EXPECT_TRUE(is_node(kept, x));
  }
  const auto [count, length] = kept_edges(kept, 2.0);
  EXPECT_NEAR(length, 24.0, 1e-9);
  EXPECT_GE(count, 60);  // 24 / 0.4
  EXPECT_LE(count, 120);
  orient_elements(kept, "cube");
  check_connected(kept, "cube");
  EXPECT_GT(measure_quality(kept).min_angle, 8.0);

  MeshOptions options = edges(0.4);
  options.feature_angle = 180.0;
  options.facet_distance = 0.1;
  const Mesh rounded = mesh_surface_with_cgal(cube, options, "cube");
  EXPECT_LT(volume(rounded), 8.0 - 1e-3);
  EXPECT_GT(volume(rounded), 7.5);
  EXPECT_LT(kept_edges(rounded, 2.0).second, 12.0);
}

TEST(CgalSurface, BallHasItsSize) {
  const double h = 0.2;
  Mesh mesh = mesh_surface_with_cgal(ball(4), edges(h), "ball");
  EXPECT_NEAR(volume(mesh), 4.0 / 3.0 * std::numbers::pi, 0.1);
  orient_elements(mesh, "ball");
  check_connected(mesh, "ball");
  const Surface surface = extract_surface(mesh);
  double edge_sum = 0.0;
  for (Index f = 0; f < surface.count(); ++f) {
    const auto nodes = surface.facet_nodes(f);
    const Vec3 &a = mesh.nodes[at(nodes[0])], &b = mesh.nodes[at(nodes[1])], &c = mesh.nodes[at(nodes[2])];
    edge_sum += (a - b).norm();
    EXPECT_NEAR(((a + b + c) / 3.0).norm(), 1.0, h / 20.0 + 0.005);  // and what ball(4) is from a sphere
  }
  EXPECT_NEAR(edge_sum / surface.count(), h, 0.25 * h);
}

TEST(CgalSurface, InteriorIsGraded) {
  MeshOptions options = edges(0.15);
  const Mesh graded = mesh_surface_with_cgal(ball(3), options, "ball");
  options.grading = 0.0;
  EXPECT_LT(graded.elements(), mesh_surface_with_cgal(ball(3), options, "ball").elements() / 2);
}

TEST(CgalSurface, MeanEdgeIsTheDefault) {
  const TriangleSurface surface = ball(2);
  MeshOptions options = edges(mean_edge_length(surface));
  const Mesh given = mesh_surface_with_cgal(surface, options, "ball");
  options.edge_length.reset();
  const Mesh mean = mesh_surface_with_cgal(surface, options, "ball");
  EXPECT_EQ(given.nodes, mean.nodes);  // also: the same input gives the same mesh
  EXPECT_EQ(given.connectivity, mean.connectivity);
}

TEST(CgalSurface, OptimisationImprovesElementsAndKeepsEdges) {
  MeshOptions options = edges(0.3);
  options.perturb = options.exude = false;
  const Mesh plain = mesh_surface_with_cgal(testing::cube(2.0), options, "cube");
  options.odt = options.lloyd = options.perturb = options.exude = true;
  const Mesh best = mesh_surface_with_cgal(testing::cube(2.0), options, "cube");
  EXPECT_GT(measure_quality(best).mean_shape, measure_quality(plain).mean_shape + 0.01);
  EXPECT_GT(measure_quality(best).min_angle, measure_quality(plain).min_angle + 2.0);
  EXPECT_NEAR(volume(best), 8.0, 1e-9);
}

TEST(MeshParts, CrumbsAreRemoved) {
  Mesh mesh = mesh_surface_with_cgal(testing::cube(2.0), edges(0.3), "cube");
  const Index elements = mesh.elements();
  const auto nodes = mesh.nodes.size();
  EXPECT_EQ(remove_crumbs(mesh), 0);
  mesh.nodes.insert(mesh.nodes.end(), {{0, 0, -1}, {1, 0, -1}, {0, 1, -1}});  // hangs on node 0
  mesh.connectivity.insert(
      mesh.connectivity.end(),
      {0, static_cast<Index>(nodes), static_cast<Index>(nodes) + 1, static_cast<Index>(nodes) + 2});
  mesh.regions.push_back(7);
  EXPECT_EQ(remove_crumbs(mesh), 1);
  EXPECT_EQ(mesh.elements(), elements);
  EXPECT_EQ(mesh.nodes.size(), nodes);
  EXPECT_EQ(std::count(mesh.regions.begin(), mesh.regions.end(), 0), elements);
}

TEST(MeshParts, OnePointInEachPartOfARegion) {
  Mesh mesh;  // three tetrahedra in a row, the outer ones of the same region, and a fourth on the third
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {2, 1, 1}, {1, 3, 2}};
  mesh.connectivity = {0, 1, 2, 3, 1, 2, 3, 4, 2, 3, 4, 5, 3, 4, 5, 6};
  mesh.regions = {4, 9, 4, 4};
  const std::vector<RegionPoint> points = region_points(mesh);
  ASSERT_EQ(points.size(), 3U);
  std::vector<Index> regions;
  for (const RegionPoint& point : points) {
    regions.push_back(point.region);
  }
  std::sort(regions.begin(), regions.end());
  EXPECT_EQ(regions, (std::vector<Index>{4, 4, 9}));
  const Index larger = volume(mesh, 2) > volume(mesh, 3) ? 2 : 3;
  Vec3 middle = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    middle += testing::corner(mesh, larger, i) / 4.0;
  }
  EXPECT_TRUE(std::any_of(points.begin(), points.end(),
                          [&](const RegionPoint& p) { return (p.x - middle).norm() < 1e-12; }));
}

}  // namespace
}  // namespace palpate::cgal_test
