// Generated bodies, their surfaces and their quality.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "meshes/check.h"
#include "meshes/generate.h"
#include "meshes/quality.h"
#include "meshes/surface.h"
#include "meshes/tet4.h"
#include "tests/meshes_files.h"

namespace palpate {
namespace {

using std::numbers::pi;
using test::contains;
using test::error_of;

const Vec3& node_of(const Mesh& mesh, Index node) {
  return mesh.nodes[static_cast<std::size_t>(node)];
}

/// Volume inside the surface by the divergence theorem.
double enclosed_volume(const Mesh& mesh, const Surface& surface) {
  double volume = 0.0;
  for (const Triangle& t : surface.triangles) {
    volume += node_of(mesh, t[0]).dot(node_of(mesh, t[1]).cross(node_of(mesh, t[2]))) / 6.0;
  }
  return volume;
}

/// Every edge of a closed oriented surface is passed once in each direction.
bool is_closed(const Surface& surface) {
  std::map<std::pair<Index, Index>, int> passes;
  for (const Triangle& t : surface.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++passes[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : passes) {
    const auto back = passes.find({edge.second, edge.first});
    if (count != 1 || back == passes.end() || back->second != 1) return false;
  }
  return true;
}

TEST(Box, OneCellIsSixTetrahedraAlongTheDiagonal) {
  const Mesh mesh = generate(BoxShape{});
  ASSERT_EQ(mesh.nodes.size(), 8u);
  for (int node = 0; node < 8; ++node) {  // x fastest, then y, then z
    EXPECT_EQ(node_of(mesh, node), Vec3(node & 1, (node >> 1) & 1, node >> 2));
  }
  ASSERT_EQ(mesh.tets.size(), 6u);
  for (const Tet& tet : mesh.tets) {
    EXPECT_EQ(std::count(tet.begin(), tet.end(), 0), 1);
    EXPECT_EQ(std::count(tet.begin(), tet.end(), 7), 1);
    EXPECT_NEAR(tet4::volume(tet4::corners(mesh, tet)), 1.0 / 6.0, 1e-15);
  }
}

TEST(Box, PlaceSizeAndSurface) {
  const Mesh mesh = generate(BoxShape{Vec3(-1, 2, 0.5), Vec3(0.3, 0.2, 0.7), {3, 2, 5}});
  EXPECT_EQ(mesh.nodes.size(), 4u * 3u * 6u);
  EXPECT_EQ(mesh.tets.size(), 6u * 3u * 2u * 5u);
  EXPECT_EQ(mesh.regions.size(), mesh.tets.size());
  EXPECT_LT((mesh.nodes.front() - Vec3(-1, 2, 0.5)).norm(), 1e-15);
  EXPECT_LT((mesh.nodes.back() - Vec3(-0.7, 2.2, 1.2)).norm(), 1e-15);
  const Surface surface = extract_surface(mesh);
  EXPECT_EQ(surface.triangles.size(), 4u * (3u * 2u + 2u * 5u + 3u * 5u));
  EXPECT_EQ(surface.nodes.size(), mesh.nodes.size() - 8);  // 2 x 1 x 4 inside
  EXPECT_TRUE(std::is_sorted(surface.nodes.begin(), surface.nodes.end()));
  EXPECT_TRUE(is_closed(surface));
  EXPECT_NEAR(enclosed_volume(mesh, surface), 0.3 * 0.2 * 0.7, 1e-14);
}

TEST(Surface, AllFourFacesOfATetrahedronLookOutwards) {
  Mesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.tets = {{0, 1, 2, 3}};
  const Surface surface = extract_surface(mesh);
  ASSERT_EQ(surface.triangles.size(), 4u);
  const Vec3 centroid = Vec3::Constant(0.25);
  for (const Triangle& t : surface.triangles) {
    const Vec3 &a = node_of(mesh, t[0]), &b = node_of(mesh, t[1]), &c = node_of(mesh, t[2]);
    EXPECT_GT((b - a).cross(c - a).dot(a - centroid), 0.0);
  }
}

TEST(Surface, LayersCountElementsFromTheSurface) {
  const int m = 6;
  const Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3::Constant(m), {m, m, m}});
  const std::vector<Index> layers = layers_below_surface(mesh, extract_surface(mesh));
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    const Vec3& x = mesh.nodes[node];
    EXPECT_EQ(layers[node], std::lround(std::min(x.minCoeff(), m - x.maxCoeff())));
  }
}

TEST(Surface, OverlappingElementsAreRefused) {
  Mesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}, {0, 0, 2}};
  mesh.tets = {{0, 1, 2, 3}, {0, 2, 1, 4}};
  EXPECT_EQ(extract_surface(mesh).triangles.size(), 6u);
  mesh.tets.push_back({0, 1, 2, 5});
  const Error three = error_of([&] { extract_surface(mesh); });
  EXPECT_TRUE(contains(three.what(), "3 elements share the face of nodes 0, 1, 2")) << three.what();
  mesh.tets = {{0, 1, 2, 3}, {0, 1, 2, 5}};
  const Error overlap = error_of([&] { extract_surface(mesh); });
  EXPECT_TRUE(contains(overlap.what(), "same side of the face of nodes 0, 1, 2")) << overlap.what();
}

TEST(Cylinder, IsThePrismOverARegularPolygon) {
  const CylinderShape shape{0.05, 0.2, 8, 5};
  const Mesh mesh = generate(shape);
  const double corners = 4.0 * shape.cells_across;
  const double volume = 0.5 * corners * std::sin(2 * pi / corners) * 0.05 * 0.05 * 0.2;
  EXPECT_NEAR(measure_quality(mesh).volume, volume, 1e-12 * volume);
  const Surface surface = extract_surface(mesh);
  EXPECT_EQ(surface.triangles.size(),
            std::size_t{2 * 32 * 5 + 2 * 2 * 64});  // any more would be a gap inside
  EXPECT_TRUE(is_closed(surface));
  EXPECT_NEAR(enclosed_volume(mesh, surface), volume, 1e-12 * volume);
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
    EXPECT_EQ(surface.triangles.size(), static_cast<std::size_t>(12 * cells * cells));
    EXPECT_TRUE(is_closed(surface));
    for (const Index node : surface.nodes) EXPECT_NEAR(node_of(mesh, node).norm(), radius, 1e-15);
    const double error = exact - measure_quality(mesh).volume;
    EXPECT_GT(error, 0.0);
    if (last_error > 0.0) {
      EXPECT_NEAR(last_error / error, 4.0, 0.2);
    }
    last_error = error;
  }
}

/// Angles stay away from 0 and 180 degrees however fine the grid is.
TEST(Shapes, ElementsAreWellShapedAtEveryRefinement) {
  for (const int cells : {2, 4, 8, 16}) {
    Mesh cylinder = generate(CylinderShape{1.0, 2.0, cells, cells}),
         sphere = generate(SphereShape{1.0, cells});
    EXPECT_EQ(orient_elements(cylinder, ""), 0u);
    EXPECT_EQ(orient_elements(sphere, ""), 0u);
    const QualityReport c = measure_quality(cylinder), s = measure_quality(sphere);
    EXPECT_GT(c.min_dihedral, 28.0);
    EXPECT_LT(c.max_dihedral, 122.0);
    EXPECT_GT(c.min_radius_ratio, 0.6);
    EXPECT_GT(s.min_dihedral, 28.0);
    EXPECT_LT(s.max_dihedral, 122.0);
    EXPECT_GT(s.min_radius_ratio, 0.6);
  }
}

TEST(Quality, RegularTetrahedron) {
  Mesh mesh;
  mesh.nodes = {{0, 0, 0}, {0, 1, 1}, {1, 0, 1}, {1, 1, 0}};
  mesh.tets = {{0, 1, 2, 3}};
  if (tet4::volume(tet4::corners(mesh, mesh.tets[0])) < 0) std::swap(mesh.tets[0][2], mesh.tets[0][3]);
  const QualityReport report = measure_quality(mesh);
  const double angle = std::acos(1.0 / 3.0) * 180.0 / pi;  // 70.5288 degrees
  EXPECT_NEAR(report.min_dihedral, angle, 1e-12);
  EXPECT_NEAR(report.max_dihedral, angle, 1e-12);
  EXPECT_NEAR(report.min_radius_ratio, 1.0, 1e-14);
  EXPECT_NEAR(report.mean_radius_ratio, 1.0, 1e-14);
  EXPECT_NEAR(report.min_edge, std::numbers::sqrt2, 1e-15);
  EXPECT_NEAR(report.volume, 1.0 / 3.0, 1e-15);
  EXPECT_EQ(report.dihedral_histogram[7], 6);
}

TEST(Quality, KuhnTetrahedronAndWorstElement) {
  Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(2, 1, 1), {2, 1, 1}});
  const QualityReport report = measure_quality(mesh);
  // Kuhn's tetrahedron: angles 45, 45, 60, 90, 90, 90; r_in = 1/(2 + 2 sqrt 2), R = sqrt(3)/2.
  EXPECT_NEAR(report.min_dihedral, 45.0, 1e-12);
  EXPECT_NEAR(report.max_dihedral, 90.0, 1e-12);
  EXPECT_NEAR(report.min_radius_ratio, 3.0 / (2.0 + 2.0 * std::numbers::sqrt2) / (std::sqrt(3.0) / 2.0),
              1e-14);
  EXPECT_NEAR(report.min_edge, 1.0, 1e-15);
  EXPECT_NEAR(report.max_edge, std::sqrt(3.0), 1e-15);
  EXPECT_EQ(
      std::accumulate(report.dihedral_histogram.begin(), report.dihedral_histogram.end(), std::int64_t{0}),
      6 * 12);
  // Node 11, the corner (2, 1, 1), is pulled far out: the elements there become the worst.
  mesh.nodes.back() = Vec3(2, 1, 9);
  const QualityReport pulled = measure_quality(mesh);
  const Tet& worst = mesh.tets[static_cast<std::size_t>(pulled.worst_element)];
  EXPECT_EQ(std::count(worst.begin(), worst.end(), 11), 1);
  EXPECT_LT((tet4::corners(mesh, worst).rowwise().mean() - pulled.worst_centroid).norm(), 1e-15);
  EXPECT_LT(pulled.min_radius_ratio, report.min_radius_ratio);
}

}  // namespace
}  // namespace palpate
