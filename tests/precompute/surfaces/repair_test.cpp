// Broken surfaces are made whole; what they enclose then is known.
#include <gtest/gtest.h>

#include <numbers>

#include "precompute/surfaces/surface_repair.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::repair_test {
namespace {

using testing::ball;
using testing::cube;
using testing::error_of;
using testing::expect_mentions;
using testing::fine_cube;
using testing::joined;
using testing::off;
using testing::TempFolder;
using testing::volume;

class Repair : public ::testing::Test {
 protected:
  RepairedSurface repair(const TriangleSurface& surface, SurfaceParts parts = SurfaceParts::largest) {
    return repair_surface(folder_.write("broken.off", off(surface)), parts, 500);
  }

  /// The repaired surface as read_surface takes it, which checks that it is closed, manifold, in one part and
  /// free of self-intersections, and turns nothing.
  TriangleSurface expect_whole(const RepairedSurface& repaired) {
    std::vector<std::string> notes;
    TriangleSurface read = read_surface(folder_.write("whole.off", off_text(repaired.surface)), notes);
    EXPECT_TRUE(notes.empty()) << notes.front();
    return read;
  }

  static std::string told(const RepairedSurface& repaired) {
    std::string text;
    for (const std::string& repair : repaired.repairs) text += repair + "\n";
    return text;
  }

  TempFolder folder_;
};

TEST_F(Repair, WholeSurfacesAreLeftAsTheyAre) {
  const RepairedSurface repaired = repair(cube());
  EXPECT_EQ(told(repaired), "");
  EXPECT_EQ(repaired.surface.triangles.size(), 12U);
  EXPECT_NEAR(volume(repaired.surface), 1.0, 1e-12);
}

TEST_F(Repair, OpenCube) {
  TriangleSurface surface = cube();
  surface.triangles.erase(surface.triangles.begin() + 2, surface.triangles.begin() + 4);  // the lid
  const RepairedSurface repaired = repair(surface);
  expect_mentions(told(repaired), {"a hole was filled", "1 units wide with 4 edges"});
  EXPECT_NEAR(volume(expect_whole(repaired)), 1.0, 1e-12);
}

TEST_F(Repair, FlippedTriangles) {
  TriangleSurface surface = fine_cube(1);
  for (const std::size_t k : {3U, 17U, 30U}) std::swap(surface.triangles[k][0], surface.triangles[k][1]);
  const RepairedSurface repaired = repair(surface);
  expect_mentions(told(repaired), {"3 polygons were turned"});
  EXPECT_NEAR(volume(expect_whole(repaired)), 1.0, 1e-12);
}

TEST_F(Repair, InsideOut) {
  TriangleSurface surface = cube();
  for (Triangle& t : surface.triangles) std::swap(t[0], t[1]);
  const RepairedSurface repaired = repair(surface);
  expect_mentions(told(repaired), {"inside out"});
  EXPECT_NEAR(volume(expect_whole(repaired)), 1.0, 1e-12);
}

TEST_F(Repair, EveryTriangleWithCornersOfItsOwn) {
  TriangleSurface loose;
  const TriangleSurface whole = cube();
  for (const Triangle& t : whole.triangles) {
    const auto first = static_cast<Index>(loose.nodes.size());
    for (const Index node : t) loose.nodes.push_back(whole.nodes[testing::at(node)]);
    loose.triangles.push_back({first, first + 1, first + 2});
  }
  const RepairedSurface repaired = repair(loose);
  EXPECT_EQ(repaired.surface.nodes.size(), 8U);
  EXPECT_NEAR(volume(expect_whole(repaired)), 1.0, 1e-12);
}

TEST_F(Repair, DoubledAndFlatTriangles) {
  TriangleSurface surface = cube();
  surface.triangles.push_back(surface.triangles[5]);
  surface.triangles.push_back({surface.triangles[7][1], surface.triangles[7][0], surface.triangles[7][2]});
  surface.triangles.push_back({0, 1, 1});
  const RepairedSurface repaired = repair(surface);
  expect_mentions(told(repaired), {"2 doubled polygons were removed", "polygon without area was removed"});
  EXPECT_NEAR(volume(expect_whole(repaired)), 1.0, 1e-12);
}

TEST_F(Repair, LargestOfSeveralParts) {
  const RepairedSurface repaired = repair(joined(cube(0.5), cube(1.0), {3, 0, 0}));
  expect_mentions(told(repaired),  // 6 of 6 + 6/4, 1 of 1 + 1/8
                  {"of 2 parts the largest was kept, 80 % of the area and 88.9 % of the volume"});
  EXPECT_NEAR(volume(expect_whole(repaired)), 1.0, 1e-12);
}

TEST_F(Repair, LosingATenthHasToBeAskedFor) {
  const TriangleSurface two = joined(cube(0.5), cube(1.0), {3, 0, 0});
  expect_mentions(error_of([&] { repair(two, SurfaceParts::most); }),
                  {"80 % of the area", "--parts all", "--parts largest"});
  const RepairedSurface crumb = repair(joined(cube(0.1), cube(1.0), {3, 0, 0}), SurfaceParts::most);
  expect_mentions(told(crumb),
                  {"of 2 parts the largest was kept, 99 % of the area and 99.9 % of the volume"});
}

TEST_F(Repair, ClosedShellsInsideAreCavities) {
  const TriangleSurface inner = ball(2), two = joined(cube(4.0), inner, {2, 2, 2});
  TriangleSurface inwards = inner;
  for (Triangle& t : inwards.triangles) std::swap(t[0], t[1]);
  for (const TriangleSurface& hollow :
       {two, joined(cube(4.0), inwards, {2, 2, 2}), joined(inner, cube(4.0), {-2, -2, -2})}) {
    const RepairedSurface repaired = repair(hollow, SurfaceParts::most);
    EXPECT_EQ(told(repaired), "");
    EXPECT_NEAR(volume(expect_whole(repaired)), 64.0 - volume(inner), 1e-4);
  }
  const RepairedSurface nested = repair(joined(two, cube(0.2), {1.9, 1.9, 1.9}), SurfaceParts::most);
  expect_mentions(told(nested), {"of 3 parts the largest was kept"});  // what is in the cavity is not
  EXPECT_NEAR(volume(expect_whole(nested)), 64.0 - volume(inner), 1e-4);
  TriangleSurface open = two;
  open.triangles.erase(open.triangles.begin(), open.triangles.begin() + 2);
  const RepairedSurface closed = repair(open, SurfaceParts::most);
  expect_mentions(told(closed), {"a hole was filled"});
  EXPECT_NEAR(volume(expect_whole(closed)), 64.0 - volume(inner), 1e-4);
}

/// A surface whose triangles have corners of their own, each moved by up to `jitter` along each axis.
TriangleSurface torn(const TriangleSurface& whole, double jitter) {
  TriangleSurface loose;
  int turn = 0;
  for (const Triangle& t : whole.triangles) {
    const auto first = static_cast<Index>(loose.nodes.size());
    for (const Index node : t) {
      const Vec3 move(turn % 3 - 1, turn % 5 / 2.0 - 1, turn % 7 / 3.0 - 1);
      loose.nodes.push_back(whole.nodes[testing::at(node)] + jitter * move);
      turn += 2;
    }
    loose.triangles.push_back({first, first + 1, first + 2});
  }
  return loose;
}

TEST_F(Repair, SeamsThatRoundingOpened) {
  const TriangleSurface whole = ball(3);
  for (const double jitter : {1e-9, 1e-7, 1e-6, 1e-5}) {
    const RepairedSurface repaired =
        repair_surface(folder_.write("torn.off", off_text(torn(whole, jitter))), SurfaceParts::most, 500);
    EXPECT_EQ(repaired.surface.nodes.size(), whole.nodes.size()) << jitter;
    expect_mentions(told(repaired), {"points were joined", "rounding"});
    EXPECT_NEAR(volume(expect_whole(repaired)), volume(whole), 1e-3);
  }
}

TEST_F(Repair, NearPointsOfAWholeSurfaceAreNotJoined) {
  TriangleSurface thin = fine_cube(2);
  for (Vec3& x : thin.nodes) x[2] *= 1e-4;
  const RepairedSurface repaired =
      repair_surface(folder_.write("thin.off", off_text(thin)), SurfaceParts::most, 500);
  EXPECT_EQ(told(repaired), "");
  EXPECT_EQ(repaired.surface.nodes.size(), thin.nodes.size());
}

TEST_F(Repair, AllPartsThatOverlap) {
  const RepairedSurface repaired = repair(joined(cube(), cube(), {0.5, 0.0, 0.0}), SurfaceParts::all);
  expect_mentions(told(repaired), {"it was wrapped"});
  // 1.5 and, by at most 1.5 offsets, what lies around its area of 8.
  const double offset = usual_wrap_offset * edge_for_nodes(12.0, 500);
  EXPECT_GT(volume(expect_whole(repaired)), 1.5);
  EXPECT_LT(volume(repaired.surface), 1.5 + 8.0 * 1.5 * offset);
}

TEST_F(Repair, PartsThatAreApartCannotBeUnited) {
  const std::string error = error_of([&] { repair(joined(cube(), cube(), {3, 0, 0}), SurfaceParts::all); });
  expect_mentions(error, {"broken.off", "2 parts that are apart", "--parts largest"});
}

/// A cube of which the middle of the lid goes to `x`, through the floor.
TriangleSurface spiked_cube(const Vec3& x) {
  TriangleSurface surface = fine_cube(1);
  for (Vec3& node : surface.nodes)
    if (node == Vec3(0.5, 0.5, 1.0)) node = x;
  return surface;
}

TEST_F(Repair, SelfIntersection) {
  const RepairedSurface repaired = repair(spiked_cube({0.5, 0.5, -1.0}));
  expect_mentions(told(repaired), {"intersects itself"});
  const double inside = volume(expect_whole(repaired));
  EXPECT_GT(inside, 0.3);
  EXPECT_LT(inside, 1.2);
}

// Cut out where it intersects itself, the symmetric cube would be left with 0.13.
TEST_F(Repair, SelfIntersectionWhoseRepairWouldTakeTheBodyIsWrapped) {
  constexpr double pyramid = 0.75 * 2.0 / 3.0;  // from six nodes of the lid down
  constexpr double tip = pyramid / 8.0;         // below the floor
  constexpr double outside = 1.0 - (pyramid - tip) + tip;
  for (const double aside : {0.0, 0.03, 0.1}) {
    const RepairedSurface repaired = repair(spiked_cube({0.5 + aside, 0.5 + aside / 2.0, -1.0}));
    expect_mentions(told(repaired), {"intersects itself", "wrapped"});
    const double inside = volume(expect_whole(repaired));
    EXPECT_GT(inside, outside) << aside;
    EXPECT_LT(inside, outside + 0.1) << aside;  // the wrap lies off the surface, over an area of some 8
  }
}

TEST_F(Repair, SheetEnclosesNothing) {
  TriangleSurface sheet = fine_cube(2);
  for (Vec3& x : sheet.nodes) x[2] = 0.0;
  sheet.triangles.resize(sheet.triangles.size() / 6);  // the floor alone
  expect_mentions(error_of([&] { repair(sheet); }), {"broken.off", "encloses nothing", "thickness"});
}

TEST_F(Repair, UnreadableFile) {
  const std::filesystem::path file = folder_.write("none.stl", "this is no surface\n");
  expect_mentions(error_of([&] { repair_surface(file, SurfaceParts::largest, 500); }),
                  {"none.stl", "cannot read a surface"});
}

TEST(EdgeForNodes, IsThatOfTheBall) {
  // The octahedron refined five times: 4098 nodes on an area close to 4 pi.
  const TriangleSurface surface = ball(5);
  const double edge = edge_for_nodes(4.0 * std::numbers::pi, static_cast<double>(surface.nodes.size()));
  EXPECT_NEAR(mean_edge_length(surface), edge, 0.03 * edge);
}

}  // namespace
}  // namespace palpate::repair_test
