// Distances from sharp edges along surfaces, against those of a box.
#include "runtime/core/body/wedges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace palpate::wedges_test {
namespace {

/// Surface of a prism over the polygon (0, 0), (8, 0), (8 + slant, 5), (slant, 5) in x and z, 6 long in y, in
/// squares of edge 1 that are halved.
struct Prism {
  std::vector<Vec3> nodes;
  std::vector<Index> triangles;

  explicit Prism(double slant) : slant_(slant) {
    for (const double y : {0.0, 6.0}) face({0, y, 0}, {1, 0, 0}, {0, 0, 1}, 8, 5, y == 0.0);
    for (const double z : {0.0, 5.0}) face({0, 0, z}, {1, 0, 0}, {0, 1, 0}, 8, 6, z != 0.0);
    for (const double x : {0.0, 8.0}) face({x, 0, 0}, {0, 1, 0}, {0, 0, 1}, 6, 5, x != 0.0);
  }

 private:
  Index number(const Vec3& place) {
    const Vec3 x(place.x() + slant_ * place.z() / 5.0, place.y(), place.z());
    const auto found =
        std::find_if(nodes.begin(), nodes.end(), [&](const Vec3& node) { return (node - x).norm() < 1e-9; });
    if (found == nodes.end()) return nodes.push_back(x), static_cast<Index>(nodes.size()) - 1;
    return static_cast<Index>(found - nodes.begin());
  }
  void face(const Vec3& origin, const Vec3& u, const Vec3& v, int along_u, int along_v,
            bool is_right_handed) {
    for (int i = 0; i < along_u; ++i) {
      for (int j = 0; j < along_v; ++j) {
        const auto at = [&](int a, int b) { return number(origin + (i + a) * u + (j + b) * v); };
        std::array<Index, 4> square{at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
        if (!is_right_handed) std::swap(square[1], square[3]);
        triangles.insert(triangles.end(), {square[0], square[1], square[2], square[0], square[2], square[3]});
      }
    }
  }
  double slant_;
};

constexpr double crease = 40.0 * std::numbers::pi / 180.0;

TEST(Wedges, AreAsFarAsOnTheFaceOfABox) {
  const Prism box(0.0);
  const auto found = wedges_beside(box.nodes, box.triangles, crease, 2.6);
  for (std::size_t k = 0; k < box.nodes.size(); ++k) {
    const Vec3& x = box.nodes[k];
    std::array<double, 3> from{std::min(x.x(), 8.0 - x.x()), std::min(x.y(), 6.0 - x.y()),
                               std::min(x.z(), 5.0 - x.z())};
    std::sort(from.begin(), from.end());  // the first is the face's own
    for (std::size_t e = 0; e < 2; ++e) {
      const double wanted = from[e + 1];
      if (wanted < 2.6) {
        EXPECT_NEAR(found[k][e].distance, wanted, 1e-9) << x.transpose();
        EXPECT_NEAR(found[k][e].angle, std::numbers::pi / 2.0, 1e-9);
      } else {
        EXPECT_TRUE(std::isinf(found[k][e].distance)) << x.transpose();
      }
    }
  }
}

TEST(Wedges, AreConvexAndSharp) {
  const Prism slanted(3.0);  // angles of 59 and 121 degrees along y
  const auto found = wedges_beside(slanted.nodes, slanted.triangles, crease, 1.2);
  Prism inside_out = slanted;
  for (std::size_t s = 0; s < inside_out.triangles.size(); s += 3)
    std::swap(inside_out.triangles[s], inside_out.triangles[s + 1]);
  const auto of_hollow = wedges_beside(inside_out.nodes, inside_out.triangles, crease, 1.2);
  const auto of_blunt = wedges_beside(slanted.nodes, slanted.triangles, std::numbers::pi - 0.9, 1.2);
  int acute = 0, obtuse = 0;
  for (std::size_t k = 0; k < slanted.nodes.size(); ++k) {
    const double y = slanted.nodes[k].y();
    EXPECT_TRUE(std::isinf(of_hollow[k][0].distance) && std::isinf(of_blunt[k][0].distance));
    if (found[k][0].distance > 0.5 || y < 1.5 || y > 4.5) continue;
    const double of_acute = std::atan2(5.0, 3.0);
    const bool is_acute = std::abs(found[k][0].angle - of_acute) < 1e-9;
    acute += is_acute ? 1 : 0;
    obtuse += is_acute ? 0 : 1;
    if (!is_acute) {
      EXPECT_NEAR(found[k][0].angle, std::numbers::pi - of_acute, 1e-9);
    }
  }
  EXPECT_EQ(acute, 6);  // nodes at y of 2 to 4 on each of two edges
  EXPECT_EQ(obtuse, 6);
}

}  // namespace
}  // namespace palpate::wedges_test
