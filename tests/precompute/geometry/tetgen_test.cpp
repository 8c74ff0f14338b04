// TetGen in its child process, on whole and damaged surfaces.
#include <gtest/gtest.h>

#include "meshes/check.h"
#include "meshes/surface.h"
#include "precompute/geometry/tetgen_mesh.h"
#include "precompute/surfaces/shells.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::tetgen_test {
namespace {

using testing::at;
using testing::ball;
using testing::error_of;
using testing::expect_mentions;
using testing::volume;

/// Mean length of the elements' edges whose middle is at most (inside) or at least (otherwise) `radius` from
/// the origin.
double mean_edge(const Mesh& mesh, double radius, bool inside) {
  double sum = 0.0;
  int count = 0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Vec3 &a = testing::corner(mesh, e, i), &b = testing::corner(mesh, e, j);
        if (((a + b).norm() / 2.0 <= radius) == inside) {
          sum += (a - b).norm();
          ++count;
        }
      }
    }
  }
  return sum / count;
}

TEST(TetGen, FillsTheSurfaceAndKeepsIt) {
  for (const TriangleSurface& surface :
       {testing::tetrahedron(), testing::cube(), testing::fine_cube(2), ball(3)}) {
    Mesh mesh = mesh_surface(surface, {}, "surface");
    EXPECT_NEAR(volume(mesh), volume(surface), 1e-12);
    orient_elements(mesh, "surface");
    check_connected(mesh, "surface");
    const Surface boundary = extract_surface(mesh);
    EXPECT_EQ(at(boundary.count()), surface.triangles.size());
    EXPECT_EQ(boundary.nodes.size(), surface.nodes.size());
    for (std::size_t i = 0; i < surface.nodes.size(); ++i) {
      EXPECT_EQ(mesh.nodes[i], surface.nodes[i]);
    }
  }
}

TEST(TetGen, CavitiesStayEmpty) {
  TriangleSurface cavity = ball(1), surface = testing::fine_cube(2, 8.0);
  turn(cavity, false);
  for (const Vec3& place : {Vec3(2, 2, 2), Vec3(6, 5, 4)}) surface = testing::joined(surface, cavity, place);
  const Mesh mesh = mesh_surface(surface, {}, "hollow");
  EXPECT_NEAR(volume(mesh), 512.0 + 2.0 * volume(cavity), 1e-9);
  EXPECT_EQ(at(extract_surface(mesh).count()), surface.triangles.size());
}

TEST(TetGen, GradesTheInterior) {
  const TriangleSurface surface = ball(4);  // mean edge 0.066
  const double h = mean_edge_length(surface);
  MeshOptions options;
  const Mesh graded = mesh_surface(surface, options, "ball");
  options.grading = 0.0;
  const Mesh uniform = mesh_surface(surface, options, "ball");

  EXPECT_NEAR(mean_edge(uniform, 0.7, true), h, 0.15 * h);
  EXPECT_GT(mean_edge(graded, 0.4, true), 2.0 * h);  // the target at depth 0.7 is h + 0.35, that is 6 h
  EXPECT_LT(graded.elements(), uniform.elements() / 2);
}

TEST(TetGen, EdgeLengthIsTheTargetInside) {
  MeshOptions options;
  options.grading = 0.0;
  options.edge_length = 0.1;
  const Mesh mesh = mesh_surface(testing::fine_cube(3), options, "cube");
  EXPECT_NEAR(mean_edge(mesh, 10.0, true), 0.1, 0.025);
}

TEST(TetGen, PartsTakeTheRegionsOfTheirPoints) {
  TriangleSurface walls = testing::joined(testing::fine_cube(1, 4.0), testing::cube(), {1.5, 1.5, 1.5});
  const std::vector<RegionPoint> points = {{{0.5, 0.5, 0.5}, 127}, {{2, 2, 2}, -3}};
  const Mesh both = mesh_regions(walls, points, {}, expected_size(walls, {}), "boxes");
  double inner = 0.0;
  for (Index e = 0; e < both.elements(); ++e) {
    ASSERT_TRUE(both.regions[at(e)] == 127 || both.regions[at(e)] == -3);
    inner += both.regions[at(e)] == -3 ? volume(both, e) : 0.0;
  }
  EXPECT_NEAR(inner, 1.0, 1e-12);
  EXPECT_NEAR(volume(both), 64.0, 1e-12);

  const Mesh hollow =
      mesh_regions(walls, {points[0]}, {}, expected_size(walls, {}), "boxes");  // no point: left empty
  EXPECT_NEAR(volume(hollow), 63.0, 1e-12);
  EXPECT_EQ(std::count(hollow.regions.begin(), hollow.regions.end(), 127), hollow.elements());
}

TEST(TetGen, SelfIntersectionIsRefused) {
  const TriangleSurface crossing = testing::joined(testing::cube(), testing::cube(), {0.5, 0.4, 0.3});
  expect_mentions(error_of([&] { mesh_surface(crossing, {}, "bad.off"); }),
                  {"bad.off", "TetGen stopped with code 3", "intersects itself"});
}

TEST(TetGen, OpenSurfaceIsRefused) {
  TriangleSurface surface = testing::cube();
  surface.triangles.pop_back();
  expect_mentions(error_of([&] { mesh_surface(surface, {}, "bad.off"); }), {"bad.off", "no inside"});
}

}  // namespace
}  // namespace palpate::tetgen_test
