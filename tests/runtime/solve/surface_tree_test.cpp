// The tree against looking at every simplex, and inside() against solid angles.
#include "runtime/core/solve/surface_tree.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "meshes/generate.h"
#include "meshes/surface.h"

namespace palpate::surface_tree_test {
namespace {

constexpr double pi = std::numbers::pi;

std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

/// A surface with its own numbering of its nodes, and where they are.
struct Simplices {
  int corners = 3;
  std::vector<Index> nodes;
  std::vector<Vec3> positions;

  [[nodiscard]] Index count() const { return static_cast<Index>(nodes.size()) / corners; }
  [[nodiscard]] const Vec3& corner(Index simplex, int k) const {
    return positions[at(nodes[at(corners * simplex + k)])];
  }
  [[nodiscard]] Eigen::AlignedBox3d box(Index simplex) const {
    Eigen::AlignedBox3d box;
    for (int k = 0; k < corners; ++k) box.extend(corner(simplex, k));
    return box;
  }
  [[nodiscard]] NearestPoint nearest(Index simplex, const Vec3& p) const {
    return corners == 3 ? nearest_on_triangle(p, corner(simplex, 0), corner(simplex, 1), corner(simplex, 2))
                        : nearest_on_line(p, corner(simplex, 0), corner(simplex, 1));
  }
  [[nodiscard]] SurfaceTree tree(double margin) const { return {nodes, corners, positions, margin}; }
};

Simplices surface_of(const Mesh& mesh) {
  const Surface surface = extract_surface(mesh);
  Simplices result{mesh.dimension(), surface_simplices(surface), {}};
  for (Index& node : result.nodes) {
    const auto place = std::lower_bound(surface.nodes.begin(), surface.nodes.end(), node);
    node = static_cast<Index>(place - surface.nodes.begin());
  }
  for (const Index node : surface.nodes) result.positions.push_back(mesh.nodes[at(node)]);
  return result;
}

/// Only the elements whose centre is where it is wanted.
Mesh part_of(Mesh mesh, const std::function<bool(const Vec3&)>& is_wanted) {
  std::vector<Index> kept;
  for (Index e = 0; e < mesh.elements(); ++e) {
    Vec3 centre = Vec3::Zero();
    for (const Index node : mesh.element_nodes(e)) {
      centre += mesh.nodes[at(node)] / static_cast<double>(mesh.element_nodes(e).size());
    }
    if (is_wanted(centre)) {
      kept.insert(kept.end(), mesh.element_nodes(e).begin(), mesh.element_nodes(e).end());
    }
  }
  mesh.connectivity = kept;
  mesh.regions.assign(static_cast<std::size_t>(mesh.elements()), 0);
  return mesh;
}

bool is_in_l(const Vec3& p) {
  return p.x() > 0.0 && p.x() < 1.0 && p.y() > 0.0 && p.y() < 1.0 && (p.x() < 0.5 || p.y() < 0.5);
}

Simplices sphere() {
  return surface_of(generate(SphereShape{.radius = 1.0, .cells_across = 8}));
}
Simplices cube() {
  return surface_of(generate(BoxShape{.cells = {6, 6, 6}}));
}
Simplices l_block() {
  return surface_of(part_of(generate(BoxShape{.cells = {4, 4, 2}}), is_in_l));
}
Simplices square() {
  return surface_of(generate(RectangleShape{.cells = {7, 7}}, ElementType::tri3));
}
Simplices l_plate() {
  return surface_of(part_of(generate(RectangleShape{.cells = {4, 4}}, ElementType::tri3), is_in_l));
}
/// The sphere with all nodes drawn in or out at random: spikes and dents, but the rays from the centre meet
/// it once.
Simplices star(unsigned seed) {
  std::mt19937 random(seed);
  Simplices star = sphere();
  for (Vec3& p : star.positions) p *= std::uniform_real_distribution(0.3, 1.5)(random);
  return star;
}
/// The same of a square in the plane, around its middle.
Simplices flat_star(unsigned seed) {
  std::mt19937 random(seed);
  Simplices star = square();
  for (Vec3& p : star.positions) {
    p = std::uniform_real_distribution(0.3, 1.5)(random) * (p - Vec3(0.5, 0.5, 0.0));
  }
  return star;
}

/// Turns of the surface around p: 1 inside, 0 outside, by solid angles (Van Oosterom & Strackee 1983), in the
/// plane by angles.
double winding(const Simplices& surface, const Vec3& p) {
  double sum = 0.0;
  for (Index simplex = 0; simplex < surface.count(); ++simplex) {
    const Vec3 a = surface.corner(simplex, 0) - p;
    const Vec3 b = surface.corner(simplex, 1) - p;
    if (surface.corners == 2) {
      sum += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)) / (2.0 * pi);
      continue;
    }
    const Vec3 c = surface.corner(simplex, 2) - p;
    const double below =
        a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() + b.dot(c) * a.norm() + c.dot(a) * b.norm();
    sum += 2.0 * std::atan2(a.dot(b.cross(c)), below) / (4.0 * pi);
  }
  return sum;
}

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double number(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  Index index(Index count) { return std::uniform_int_distribution<Index>(0, count - 1)(random_); }
  /// In [-size, size]^3, in the plane with z = 0.
  Vec3 vector(double size, int dimension) {
    Vec3 v = Vec3::Zero();
    for (int axis = 0; axis < dimension; ++axis) v[axis] = number(-size, size);
    return v;
  }

 private:
  std::mt19937 random_;
};

/// Moves a node of the tree and of the surface that it is compared with.
void move(Simplices& surface, SurfaceTree& tree, Index node, const Vec3& position) {
  surface.positions[at(node)] = position;
  tree.move(node, position);
}

std::vector<Index> found_near(const SurfaceTree& tree, const Vec3& p, const Vec3& q, double reach) {
  std::vector<Index> found(tree.near_segment(p, q, reach, {}));
  EXPECT_EQ(tree.near_segment(p, q, reach, found), found.size());
  return found;
}

std::vector<Index> near_by_all(const Simplices& surface, const Vec3& p, const Vec3& q, double reach) {
  Eigen::AlignedBox3d box(p);
  box.extend(q);
  std::vector<Index> near;
  for (Index simplex = 0; simplex < surface.count(); ++simplex) {
    if (surface.box(simplex).exteriorDistance(box) <= reach) near.push_back(simplex);
  }
  return near;
}

std::vector<Index> sorted(std::vector<Index> values) {
  std::sort(values.begin(), values.end());
  return values;
}

/// The tree's box holds all nodes and is no more than two margins larger.
void expect_tight(const Simplices& surface, const SurfaceTree& tree, double margin) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.positions) box.extend(p);
  EXPECT_TRUE(tree.bounds().contains(box));
  EXPECT_LE((box.min() - tree.bounds().min()).maxCoeff(), 2.0 * margin + 1e-12);
  EXPECT_LE((tree.bounds().max() - box.max()).maxCoeff(), 2.0 * margin + 1e-12);
}

class SurfaceTrees : public testing::TestWithParam<Simplices (*)()> {};
INSTANTIATE_TEST_SUITE_P(Shape, SurfaceTrees, testing::Values(sphere, cube, l_block, square, l_plate));

/// Moves by little, much and very much, now and then all the way home.
TEST_P(SurfaceTrees, FindsWhatLookingAtAllFinds) {
  Simplices surface = GetParam()();
  const Simplices rest = surface;
  const double margin = 0.02;
  SurfaceTree tree = surface.tree(margin);
  Random random(7);
  for (int round = 0; round < 100; ++round) {
    const double size = std::pow(10.0, random.number(-4.0, 0.5));
    for (int k = 0; k < 100; ++k) {
      const Index node = random.index(static_cast<Index>(surface.positions.size()));
      const Vec3& from = round % 3 == 0 ? rest.positions[at(node)] : surface.positions[at(node)];
      move(surface, tree, node, from + random.vector(size, surface.corners));
      ASSERT_EQ(tree.position(node), surface.positions[at(node)]);
      if (round % 4 == 0) tree.refit();
    }
    tree.refit();
    expect_tight(surface, tree, margin);
    for (int k = 0; k < 5; ++k) {
      const Vec3 p = random.vector(2.0, surface.corners);
      const Vec3 q = k == 0 ? p : p + random.vector(0.5, surface.corners);
      const double reach = random.number(0.0, 0.5);
      ASSERT_EQ(sorted(found_near(tree, p, q, reach)), near_by_all(surface, p, q, reach)) << round;
    }
    for (int k = 0; k < 5; ++k) {
      const Vec3 p = random.vector(2.0, surface.corners);
      double least = std::numeric_limits<double>::infinity();
      for (Index simplex = 0; simplex < surface.count(); ++simplex) {
        least = std::min(least, surface.nearest(simplex, p).squared_distance);
      }
      const NearestSimplex found = tree.nearest(p);
      ASSERT_NEAR(found.nearest.squared_distance, least, 1e-15) << round;
      EXPECT_EQ(found.nearest.on_simplex, surface.nearest(found.simplex, p).on_simplex);
    }
  }
}

TEST_P(SurfaceTrees, ShrinksWhenTheSurfaceComesBack) {
  Simplices surface = GetParam()();
  const Simplices rest = surface;
  const double margin = 0.05;
  SurfaceTree tree = surface.tree(margin);
  const SurfaceTree at_rest = tree;
  Random random(3);
  for (Index node = 0; node < static_cast<Index>(surface.positions.size()); ++node) {
    const Vec3 home = rest.positions[at(node)];
    for (const double far : {1e3, 1e9, 1.0}) {
      move(surface, tree, node, home + random.vector(far, surface.corners));
      tree.refit();
      expect_tight(surface, tree, margin);
    }
    for (int step = 100; step >= 0; --step) {  // comes home slowly
      move(surface, tree, node, home + 0.01 * step * Vec3(1, 1, 0));
    }
    tree.refit();
    expect_tight(surface, tree, margin);
  }
  EXPECT_LE((tree.bounds().max() - at_rest.bounds().max()).cwiseAbs().maxCoeff(), margin + 1e-12);
}

TEST_P(SurfaceTrees, OrderIsThatOfTheSurfaceAndNotOfItsHistory) {
  Simplices surface = GetParam()();
  SurfaceTree moved = surface.tree(0.01);
  const SurfaceTree fresh = moved;  // a copy that the moves do not reach
  Random random(5);
  for (Index node = 0; node < static_cast<Index>(surface.positions.size()); ++node) {
    moved.move(node, random.vector(3.0, surface.corners));
    EXPECT_EQ(fresh.position(node), surface.positions[at(node)]);
  }
  for (Index node = static_cast<Index>(surface.positions.size()); node-- > 0;) {
    moved.move(node, surface.positions[at(node)]);
  }
  moved.refit();
  const Vec3 p = surface.positions.front();
  const std::vector<Index> found = found_near(fresh, p, p, 0.4);
  ASSERT_GE(found.size(), 4U);
  EXPECT_EQ(found_near(moved, p, p, 0.4), found);

  std::vector<Index> first(3, -1);  // no room for all: the first ones and how many there are
  EXPECT_EQ(fresh.near_segment(p, p, 0.4, first), found.size());
  EXPECT_EQ(first, std::vector<Index>(found.begin(), found.begin() + 3));
}

TEST(SurfaceTree, OfOneSimplexOrOfManyInOnePlace) {
  for (const Index count : {1, 4, 5, 1000}) {
    Simplices surface{3, {}, {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}};
    for (Index k = 0; k < count; ++k) surface.nodes.insert(surface.nodes.end(), {0, 1, 2});
    SurfaceTree tree = surface.tree(0.1);
    move(surface, tree, 2, Vec3(0, 2, 0));
    tree.refit();
    std::vector<Index> all(at(count));
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(sorted(found_near(tree, Vec3(0, 2, 1), Vec3(0, 3, 1), 1.0)), all);
    EXPECT_EQ(found_near(tree, Vec3(0, 2, 1), Vec3(0, 3, 1), 0.99).size(), 0U);
    EXPECT_EQ(tree.nearest(Vec3(0, 5, 4)).nearest.squared_distance, 25.0);
  }
}

TEST(SurfaceTree, OfNothingOrWithoutMarginIsRefused) {
  const auto message = [](const std::vector<Index>& simplices, double margin) {
    try {
      const SurfaceTree tree(simplices, 2, std::vector<Vec3>(2, Vec3::Zero()), margin);
    } catch (const Error& error) {
      return to_text(error);
    }
    return std::string();
  };
  EXPECT_NE(message({}, 0.1).find("0 simplices"), std::string::npos);
  EXPECT_NE(message({0, 1}, 0.0).find("margin above 0"), std::string::npos);
  EXPECT_NE(message({0, 1}, std::numeric_limits<double>::quiet_NaN()).find("margin above 0"),
            std::string::npos);
  EXPECT_EQ(message({0, 1}, 0.1), "");
}

TEST(SurfaceTree, FindsTheNearestAtAnyDistance) {
  const SurfaceTree tree = sphere().tree(0.1);
  for (const double far : {1e100, 1e200, 1e308}) {
    const NearestSimplex found = tree.nearest(Vec3(0, far, 0));
    EXPECT_GE(found.simplex, 0);
    EXPECT_TRUE(found.nearest.on_simplex.allFinite());
    EXPECT_FALSE(tree.inside(Vec3(0, far, 0)));
    EXPECT_EQ(tree.near_segment(Vec3(0, far, 0), Vec3(0, far, far), 1.0, {}), 0U);
  }
  EXPECT_NEAR(tree.nearest(Vec3(0, 1e6, 0)).nearest.on_simplex.y(), 1.0, 1e-9);
}

/// Everywhere, and close to its vertices, edges and faces.
void expect_inside_by_winding(const Simplices& surface, unsigned seed) {
  const SurfaceTree tree = surface.tree(0.05);
  Random random(seed);
  int inside = 0;
  int outside = 0;
  for (int k = 0; k < 3000; ++k) {
    Vec3 p = random.vector(1.5, surface.corners);
    if (k % 4 != 0) {  // over a vertex, an edge, a face
      const Index simplex = random.index(surface.count());
      const double u = random.number(0, 1);
      const double v = k % 4 == 3 && surface.corners == 3 ? random.number(0, 1.0 - u) : 0.0;
      p = surface.corner(simplex, 0);
      if (k % 4 > 1) p += u * (surface.corner(simplex, 1) - surface.corner(simplex, 0));
      if (v > 0.0) p += v * (surface.corner(simplex, 2) - surface.corner(simplex, 0));
      p += random.vector(std::pow(10.0, random.number(-6, -1)), surface.corners);
    }
    if (tree.nearest(p).nearest.squared_distance < 1e-16) continue;
    const double turns = winding(surface, p);
    ASSERT_LT(std::abs(turns - std::round(turns)), 1e-6);
    ASSERT_EQ(tree.inside(p), turns > 0.5) << p.transpose();
    ++(turns > 0.5 ? inside : outside);
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 500);
}

TEST_P(SurfaceTrees, InsideIsWhereTheSurfaceGoesAround) {
  expect_inside_by_winding(GetParam()(), 1);
}

TEST(SurfaceTree, InsideIsRightBetweenSpikesAndDents) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    expect_inside_by_winding(star(seed), seed);
    expect_inside_by_winding(flat_star(seed), seed);
  }
}

TEST(SurfaceTree, InsideFollowsTheSurface) {
  Simplices surface = sphere();
  const Simplices spiky = star(1);
  SurfaceTree tree = surface.tree(0.02);
  for (Index node = 0; node < static_cast<Index>(surface.positions.size()); ++node) {
    move(surface, tree, node, spiky.positions[at(node)]);
  }
  tree.refit();
  const SurfaceTree fresh = spiky.tree(0.02);
  Random random(9);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 p = random.vector(1.0, 3);
    EXPECT_EQ(tree.inside(p), fresh.inside(p));
  }
}

TEST(SurfaceTree, InsideOfTheBoxIsTheFormula) {
  const SurfaceTree tree = cube().tree(0.05);
  Random random(2);
  for (int k = 0; k < 5000; ++k) {
    const Vec3 p = Vec3::Constant(0.5) + random.vector(0.7, 3);
    EXPECT_EQ(tree.inside(p), (p.array() > 0.0).all() && (p.array() < 1.0).all());
  }
}

TEST(SurfaceTree, InsideOfTheSphereIsTheFormula) {
  const Simplices surface = sphere();
  const SurfaceTree tree = surface.tree(0.05);
  double inner = 1.0;  // of the ball that the flat triangles enclose
  for (Index k = 0; k < surface.count(); ++k) {
    inner = std::min(inner, std::sqrt(surface.nearest(k, Vec3::Zero()).squared_distance));
  }
  EXPECT_GT(inner, 0.9);
  Random random(4);
  for (int k = 0; k < 5000; ++k) {
    const Vec3 p = random.vector(1.2, 3);
    if (p.norm() > inner && p.norm() <= 1.0) continue;
    EXPECT_EQ(tree.inside(p), p.norm() < 1.0);
  }
}

/// On corners, edges and faces of surfaces of all sizes, far from the origin and at it.
TEST(SurfaceTree, ThePointsOfTheSurfaceAreNotInside) {
  Random random(6);
  for (const auto shape : {sphere, cube, l_block, square, l_plate}) {
    Simplices surface = shape();
    const double scale = std::pow(10.0, random.number(-6, 6));
    const Vec3 offset = random.vector(10.0, surface.corners);
    for (Vec3& p : surface.positions) p = scale * (p + offset);
    const SurfaceTree tree = surface.tree(0.05 * scale);
    for (Index simplex = 0; simplex < surface.count(); ++simplex) {
      for (int k = 0; k < 8; ++k) {
        Vec3 p = surface.corner(simplex, 0);
        const double u = k % 3 == 0 ? 0.0 : random.number(0, 1);
        const double v = k % 3 == 2 && surface.corners == 3 ? random.number(0, 1.0 - u) : 0.0;
        p = (1.0 - u - v) * p + u * surface.corner(simplex, 1) +
            v * surface.corner(simplex, surface.corners - 1);
        EXPECT_FALSE(tree.inside(p));
      }
    }
  }
}

}  // namespace
}  // namespace palpate::surface_tree_test
