// Triangles from polygons.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "precompute/geometry/plane_mesh.h"
#include "precompute/geometry/polygon_check.h"
#include "tests/support/bodies/geometry_plane.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::plane_test {
namespace {

using testing::area;
using testing::edge_lengths;
using testing::edges_of;
using testing::error_of;
using testing::expect_mentions;
using testing::expect_plane_mesh;
using testing::least;
using testing::mean;
using testing::PlaneEdge;
using testing::signed_area;
using testing::smallest_angles;

using Line = std::vector<Vec3>;

const PolygonGeometry square = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {}};
const PolygonGeometry wedge = {{{0, 0, 0}, {1, 0, 0}, {1, 0.08, 0}}, {}};

Line circle(double radius, int points, const Vec3& center = Vec3::Zero()) {
  Line line;
  for (int i = 0; i < points; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / points;
    line.emplace_back(center + radius * Vec3(std::cos(angle), std::sin(angle), 0.0));
  }
  return line;
}

MeshOptions options(double edge_length, double grading, bool lloyd = false) {
  MeshOptions result;
  result.edge_length = edge_length;
  result.grading = grading;
  result.lloyd = lloyd;
  return result;
}

/// A mesh of which nothing is to be told.
Mesh mesh_quietly(const PolygonGeometry& polygon, const MeshOptions& with) {
  std::vector<std::string> notes;
  Mesh mesh = mesh_polygon(polygon, with, "model.toml", notes);
  EXPECT_TRUE(notes.empty());
  return mesh;
}

TEST(PlaneMesh, SquareHasTheEdgesAskedFor) {
  const Mesh mesh = mesh_quietly(square, options(0.04, 0.0));
  expect_plane_mesh(mesh, 0);
  EXPECT_NEAR(area(mesh), 1.0, 1e-12);
  EXPECT_GT(least(smallest_angles(mesh)), 20.0);
  for (const double length : edge_lengths(mesh, true)) {
    EXPECT_NEAR(length, 0.04, 1e-12);
  }
  EXPECT_NEAR(mean(edge_lengths(mesh, false)), 0.04, 0.002);
}

TEST(PlaneMesh, EitherSenseIsTaken) {
  PolygonGeometry shape = {{{0, 0, 0}, {0, 1, 0}, {0.5, 1, 0}, {0.5, 0.5, 0}, {1, 0.5, 0}, {1, 0, 0}},
                           {{{0.1, 0.1, 0}, {0.1, 0.3, 0}, {0.3, 0.3, 0}}}};
  ASSERT_LT(signed_area(shape.points), 0.0);
  ASSERT_LT(signed_area(shape.holes[0]), 0.0);
  for (int turn = 0; turn < 2; ++turn) {
    const Mesh mesh = mesh_quietly(shape, options(0.05, 0.0));
    expect_plane_mesh(mesh, 1);
    EXPECT_NEAR(area(mesh), 0.75 - 0.02, 1e-12);
    std::reverse(shape.points.begin(), shape.points.end());
    std::reverse(shape.holes[0].begin(), shape.holes[0].end());
  }
}

TEST(PlaneMesh, HolesAreEmpty) {
  const PolygonGeometry plate = {circle(1.0, 100),
                                 {circle(0.2, 30, {0.5, 0.1, 0}), circle(0.3, 40, {-0.4, -0.2, 0})}};
  const Mesh mesh = mesh_quietly(plate, options(0.06, 0.2));
  expect_plane_mesh(mesh, 2);
  EXPECT_NEAR(area(mesh),
              signed_area(plate.points) - signed_area(plate.holes[0]) - signed_area(plate.holes[1]), 1e-12);
  EXPECT_GT(least(smallest_angles(mesh)), 20.0);
}

TEST(PlaneMesh, ShortEdgesStay) {
  const PolygonGeometry disc = {circle(1.0, 200), {}};
  const Mesh mesh = mesh_quietly(disc, options(0.3, 0.0));
  EXPECT_NEAR(area(mesh), signed_area(disc.points), 1e-12);
  EXPECT_NEAR(mean(edge_lengths(mesh, true)), 2.0 * std::sin(std::numbers::pi / 200), 1e-12);
}

TEST(PlaneMesh, EdgesGrowWithTheDistance) {
  constexpr double h = 0.03, grading = 0.3;
  const PolygonGeometry ring = {circle(1.0, 400), {circle(0.1, 40, {0.3, 0, 0})}};
  const Mesh mesh = mesh_quietly(ring, options(h, grading));
  const auto distance = [](const Vec3& x) {
    return std::min(1.0 - x.norm(), (x - Vec3(0.3, 0, 0)).norm() - 0.1);
  };
  std::vector<double> near, far;  // over their targets
  for (const PlaneEdge& edge : edges_of(mesh)) {
    const double d = distance(edge.middle());
    (d < 0.1 ? near : far).push_back(edge.length() / (h + grading * d));
  }
  EXPECT_NEAR(mean(near), 1.0, 0.3);  // the lines have edges shorter than h
  EXPECT_NEAR(mean(far), 1.0, 0.15);
  EXPECT_LT(3 * mesh.elements(), mesh_quietly(ring, options(h, 0.0)).elements());
}

std::ptrdiff_t narrow_triangles(const Mesh& mesh) {
  const std::vector<double> angles = smallest_angles(mesh);
  return std::count_if(angles.begin(), angles.end(), [](double angle) { return angle < 37.0; });
}

TEST(PlaneMesh, LloydWidensTheAngles) {
  const PolygonGeometry ring = {circle(1.0, 60), {circle(0.3, 20)}};
  for (const PolygonGeometry& shape : {square, ring}) {
    const Mesh rough = mesh_quietly(shape, options(0.08, 0.0));
    const Mesh smooth = mesh_quietly(shape, options(0.08, 0.0, true));
    expect_plane_mesh(smooth, static_cast<int>(shape.holes.size()));
    EXPECT_NEAR(area(smooth), area(rough), 1e-12);
    EXPECT_GT(mean(smallest_angles(smooth)), mean(smallest_angles(rough)) + 2.0);
    EXPECT_LT(2 * narrow_triangles(smooth), narrow_triangles(rough));
    EXPECT_NEAR(mean(edge_lengths(smooth, false)), 0.08, 0.006);
  }
}

TEST(PlaneMesh, LloydKeepsTheBoundOnAngles) {
  const PolygonGeometry disc = {circle(1.0, 200), {}};  // by itself it goes down to 17 degrees here
  EXPECT_GT(least(smallest_angles(mesh_quietly(disc, options(0.03, 1.0, true)))), 20.0);
}

TEST(PlaneMesh, SharpCornersAreTold) {
  std::vector<std::string> notes;
  const Mesh mesh = mesh_polygon(wedge, options(0.02, 0.2), "model.toml", notes);
  expect_plane_mesh(mesh, 0);
  EXPECT_NEAR(area(mesh), 0.04, 1e-12);
  ASSERT_EQ(notes.size(), 1U);
  expect_mentions(notes[0], {"1 corner(s)", "less than 20 degrees", "4.57 at (0, 0)"});
  for (Index e = 0; e < mesh.elements(); ++e) {
    const std::vector<Vec3> corners = testing::triangle(mesh, e);
    if (std::find(corners.begin(), corners.end(), Vec3(0, 0, 0)) == corners.end()) {
      EXPECT_GT(testing::smallest_angle(corners), 19.999);
    }
  }
}

TEST(PlaneMesh, SharpCornersOfHolesAreTold) {
  PolygonGeometry notched = {circle(2.0, 8), {{{0, 0, 0}, {1, 0, 0}, {0.5, 0.01, 0}, {0.5, 0.5, 0}}}};
  std::vector<std::string> notes;
  mesh_polygon(notched, options(0.2, 0.5), "model.toml", notes);
  EXPECT_TRUE(notes.empty());  // the hole is sharp at (1, 0), the body around it is not
  notched.holes[0] = {{0, 0, 0}, {1, 0, 0}, {0.5, 0.5, 0}, {0.49, 0.1, 0}, {0.48, 0.5, 0}};
  mesh_polygon(notched, options(0.2, 0.5), "model.toml", notes);
  ASSERT_EQ(notes.size(), 1U);
  expect_mentions(notes[0], {"1 corner(s)", "2.86 at (0.49, 0.1)"});
}

TEST(PlaneMesh, SameInputSameMesh) {
  const PolygonGeometry ring = {circle(1.0, 60), {circle(0.3, 20)}};
  const Mesh first = mesh_quietly(ring, options(0.08, 0.3, true));
  std::mt19937 random(1);
  std::vector<std::unique_ptr<char[]>> blocks;  // other addresses must not matter
  for (int i = 0; i < 20000; ++i) {
    blocks.push_back(std::make_unique<char[]>(random() % 20000));
    if (random() % 2 == 0) {
      blocks[random() % blocks.size()].reset();
    }
  }
  const Mesh second = mesh_quietly(ring, options(0.08, 0.3, true));
  EXPECT_EQ(first.nodes, second.nodes);
  EXPECT_EQ(first.connectivity, second.connectivity);
}

TEST(PlaneMesh, RefusesWhatItCannotDo) {
  std::vector<std::string> notes;
  const auto error = [&](const MeshOptions& with) {
    return error_of([&] { mesh_polygon(square, with, "model.toml", notes); });
  };
  MeshOptions quads = options(0.1, 0.0);
  quads.element = ElementType::quad4;
  expect_mentions(error(quads), {"model.toml", "with quad4", "tri3"});
  expect_mentions(error(options(1e-9, 0.0)), {"2 million nodes", "larger edge_length"});
  // the lines alone are few nodes, the area inside is not: told before it is meshed
  expect_mentions(error(options(1e-5, 0.0)), {"nodes, more than 2 million", "larger edge_length"});
  expect_mentions(error(options(1e-5, 1e-3)), {"nodes, more than 2 million", "larger edge_length"});
}

struct BadPolygon {
  const char* name;
  PolygonGeometry polygon;
  std::vector<std::string> mentions;
};

class PolygonCheck : public ::testing::TestWithParam<BadPolygon> {};

TEST_P(PolygonCheck, SaysWhatIsWrongAndWhere) {
  expect_mentions(error_of([&] { check_polygon(GetParam().polygon, "model.toml"); }), GetParam().mentions);
}

PolygonGeometry square_with(std::vector<Line> holes) {
  return {square.points, std::move(holes)};
}

const Line small_hole = {{0.2, 0.2, 0}, {0.6, 0.2, 0}, {0.6, 0.6, 0}};

const BadPolygon bad_polygons[] = {
    {"NoPoints", {}, {"model.toml", "the outer line has 0 point(s)"}},
    {"TwoPoints", {{{0, 0, 0}, {1, 1, 0}}, {}}, {"the outer line has 2 point(s)", "at least three"}},
    {"HoleOfTwo", square_with({small_hole, {{0.1, 0.1, 0}, {0.2, 0.1, 0}}}), {"hole 2 has 2 point(s)"}},
    {"RepeatedPoint",
     {{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}},
     {"points 2 and 3 of the outer line", "(1, 0)"}},
    {"ClosedTwice",
     {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}}, {}},
     {"points 1 and 4", "joined to the first by itself"}},
    {"OnOneLine", {{{0, 0, 0}, {1, 2, 0}, {3, 6, 0}, {2, 4, 0}}, {}}, {"no area", "(0, 0)", "(1, 2)"}},
    {"BowTie",
     {{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}, {}},
     {"the outer line crosses or touches itself at (0.5, 0.5)", "from (0, 0) to (1, 1)",
      "from (1, 0) to (0, 1)"}},
    {"FoldsBack",
     {{{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {1, 1, 0}}, {}},
     {"crosses or touches itself", "from (2, 0) to (1, 0)"}},
    {"FoldsBackAtTheEnd",
     {{{1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {2, 0, 0}}, {}},
     {"crosses or touches itself", "from (0, 0) to (2, 0)"}},
    {"TouchesItself",
     {{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 0, 0}, {0, 4, 0}}, {}},
     {"touches itself at (2, 0)"}},
    {"HoleCrosses",
     square_with({{{0.5, 0.5, 0}, {1.5, 0.5, 0}, {0.5, 0.7, 0}}}),
     {"the outer line and hole 1 cross or touch at (1, 0.5)", "from (1, 0) to (1, 1)"}},
    {"HoleTouches",
     square_with({{{0.5, 0.5, 0}, {1, 0.5, 0}, {0.5, 0.7, 0}}}),
     {"the outer line and hole 1 cross or touch at (1, 0.5)"}},
    {"HoleSharesACorner",
     square_with({{{0, 0, 0}, {0.5, 0.5, 0}, {0.3, 0.6, 0}}}),
     {"the outer line and hole 1 cross or touch at (0, 0)"}},
    {"HoleOutside",
     square_with({small_hole, {{2, 2, 0}, {3, 2, 0}, {3, 3, 0}}}),
     {"hole 2 lies outside the outer line", "(2, 2)"}},
    {"HoleAround",
     square_with({{{-1, -1, 0}, {3, -1, 0}, {3, 3, 0}, {-1, 3, 0}}}),
     {"hole 1 lies outside the outer line", "(-1, -1)"}},
    {"HolesOverlap",
     square_with({small_hole, {{0.5, 0.1, 0}, {0.5, 0.3, 0}, {0.9, 0.1, 0}}}),
     {"hole 1 and hole 2 cross or touch at (0.5, 0.2)"}},
    {"HoleInHole",
     square_with({{{0.45, 0.3, 0}, {0.5, 0.3, 0}, {0.5, 0.35, 0}}, small_hole}),
     {"hole 1 lies within hole 2", "(0.45, 0.3)"}},
};

INSTANTIATE_TEST_SUITE_P(Bad, PolygonCheck, ::testing::ValuesIn(bad_polygons),
                         [](const auto& test) { return test.param.name; });

TEST(PolygonCheckGood, ManyPointsAndNeighbours) {
  PolygonGeometry good = {circle(1.0, 5000), {}};
  for (int i = 0; i < 5; ++i) {  // side by side, a hair apart
    good.holes.push_back({{-0.5 + 0.2 * i, 0, 0}, {-0.3 + 0.2 * i - 1e-9, 0, 0}, {-0.4 + 0.2 * i, 0.2, 0}});
  }
  EXPECT_NO_THROW(check_polygon(good, "model.toml"));
  std::swap(good.points[10], good.points[11]);
  expect_mentions(error_of([&] { check_polygon(good, "model.toml"); }), {"crosses or touches itself"});
}

}  // namespace
}  // namespace palpate::plane_test
