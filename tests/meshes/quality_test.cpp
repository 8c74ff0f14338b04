// Quality of elements whose angles and shapes are known.
#include "meshes/quality.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "meshes/element.h"
#include "tests/support/bodies/meshes_bodies.h"

namespace palpate::quality_test {
namespace {

using std::numbers::pi;
using std::numbers::sqrt2;

constexpr double degree = pi / 180.0;

Mesh one_element(ElementType type, std::vector<Vec3> nodes) {
  Mesh mesh;
  mesh.element = type;
  mesh.connectivity.resize(nodes.size());
  std::iota(mesh.connectivity.begin(), mesh.connectivity.end(), 0);
  mesh.nodes = std::move(nodes);
  mesh.regions = {0};
  return mesh;
}

std::int64_t angles_in(const QualityReport& report) {
  return std::accumulate(report.angle_histogram.begin(), report.angle_histogram.end(), std::int64_t{0});
}

TEST(Quality, RegularTetrahedron) {
  const QualityReport report =
      measure_quality(one_element(ElementType::tet4, {{0, 0, 0}, {0, 1, 1}, {1, 0, 1}, {1, 1, 0}}));
  const double angle = std::acos(1.0 / 3.0) / degree;  // 70.5288 degrees
  EXPECT_NEAR(report.min_angle, angle, 1e-12);
  EXPECT_NEAR(report.max_angle, angle, 1e-12);
  EXPECT_NEAR(std::abs(report.min_shape), 1.0, 1e-14);
  EXPECT_NEAR(report.min_edge, sqrt2, 1e-15);
  EXPECT_NEAR(std::abs(report.volume), 1.0 / 3.0, 1e-15);
  EXPECT_EQ(report.angle_histogram[7], 6);
}

TEST(Quality, KuhnTetrahedronAndWorstElement) {
  Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(2, 1, 1), {2, 1, 1}});
  const QualityReport report = measure_quality(mesh);
  // Kuhn's tetrahedron: angles 45, 45, 60, 90, 90, 90; r_in = 1/(2 + 2 sqrt 2), R = sqrt(3)/2.
  EXPECT_NEAR(report.min_angle, 45.0, 1e-12);
  EXPECT_NEAR(report.max_angle, 90.0, 1e-12);
  EXPECT_NEAR(report.min_shape, 3.0 / (2.0 + 2.0 * sqrt2) / (std::sqrt(3.0) / 2.0), 1e-14);
  EXPECT_NEAR(report.mean_shape, report.min_shape, 1e-14);
  EXPECT_NEAR(report.min_edge, 1.0, 1e-15);
  EXPECT_NEAR(report.max_edge, std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(report.volume, 2.0, 1e-14);
  EXPECT_EQ(angles_in(report), 6 * 12);
  // Node 11, the corner (2, 1, 1), is pulled far out: the elements there become the worst.
  mesh.nodes.back() = Vec3(2, 1, 9);
  const QualityReport pulled = measure_quality(mesh);
  const auto worst = mesh.element_nodes(pulled.worst_element);
  EXPECT_EQ(std::count(worst.begin(), worst.end(), 11), 1);
  const Vec3 centroid = element_nodes(mesh, pulled.worst_element).colwise().mean().transpose();
  EXPECT_LT((centroid - pulled.worst_centroid).norm(), 1e-15);
  EXPECT_LT(pulled.min_shape, report.min_shape);
}

TEST(Quality, StraightTetrahedraOfSecondOrderAreThoseOfFirstOrder) {
  const Mesh linear = generate(SphereShape{0.1, 4});
  const QualityReport a = measure_quality(linear),
                      b = measure_quality(with_elements(linear, ElementType::tet10, ""));
  for (const auto field : {&QualityReport::min_angle, &QualityReport::max_angle, &QualityReport::min_shape,
                           &QualityReport::mean_shape, &QualityReport::min_edge, &QualityReport::max_edge,
                           &QualityReport::volume}) {
    EXPECT_NEAR(a.*field, b.*field, 1e-12 * std::abs(a.*field));
  }
  EXPECT_EQ(a.angle_histogram, b.angle_histogram);
  EXPECT_EQ(a.worst_element, b.worst_element);
  EXPECT_LT((a.worst_centroid - b.worst_centroid).norm(), 1e-15);
}

TEST(Quality, Triangles) {
  const QualityReport equilateral =
      measure_quality(one_element(ElementType::tri3, {{0, 0, 0}, {1, 0, 0}, {0.5, std::sqrt(0.75), 0}}));
  EXPECT_NEAR(equilateral.min_angle, 60.0, 1e-12);
  EXPECT_NEAR(equilateral.max_angle, 60.0, 1e-12);
  EXPECT_NEAR(equilateral.min_shape, 1.0, 1e-14);
  EXPECT_NEAR(equilateral.volume, std::sqrt(3.0) / 4.0, 1e-15);
  // Half a square of side s: 2 r_in / R = 2 (s (2 - sqrt 2) / 2) / (s sqrt 2 / 2).
  const QualityReport half = measure_quality(test::block(ElementType::tri3));
  EXPECT_NEAR(half.min_angle, 45.0, 1e-12);
  EXPECT_NEAR(half.max_angle, 90.0, 1e-12);
  EXPECT_NEAR(half.min_shape, 2.0 * (sqrt2 - 1.0), 1e-12);
  EXPECT_NEAR(half.min_edge, 0.1, 1e-15);
  EXPECT_NEAR(half.max_edge, 0.1 * sqrt2, 1e-15);
  EXPECT_NEAR(half.volume, 0.08, 1e-15);
  EXPECT_EQ(angles_in(half), 3 * 16);
}

TEST(Quality, SkewedQuadrilateral) {
  for (const double angle : {90.0, 75.0, 40.0, 10.0}) {
    const Vec3 side(2.0 * std::cos(angle * degree), 2.0 * std::sin(angle * degree), 0.0), base(3.0, 0.0, 0.0);
    const QualityReport report =
        measure_quality(one_element(ElementType::quad4, {Vec3::Zero(), base, base + side, side}));
    EXPECT_NEAR(report.min_angle, angle, 1e-12);
    EXPECT_NEAR(report.max_angle, 180.0 - angle, 1e-12);
    EXPECT_NEAR(report.min_shape, std::sin(angle * degree), 1e-14);
    EXPECT_NEAR(report.volume, 6.0 * std::sin(angle * degree), 1e-14);
    EXPECT_NEAR(report.min_edge, 2.0, 1e-14);
    EXPECT_NEAR(report.max_edge, 3.0, 1e-14);
    EXPECT_EQ(angles_in(report), 4);
  }
}

/// Sheared in one direction, two edges open to the angle, two to its complement and eight stay square.
TEST(Quality, SkewedHexahedron) {
  for (const double angle : {90.0, 65.0, 35.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(1, 2, 3), {1, 1, 1}}, ElementType::hex8);
      for (Vec3& x : mesh.nodes) x[axis] += x[(axis + 1) % 3] / std::tan(angle * degree);
      const QualityReport report = measure_quality(mesh);
      EXPECT_NEAR(report.min_angle, angle, 1e-12);
      EXPECT_NEAR(report.max_angle, 180.0 - angle, 1e-12);
      EXPECT_NEAR(report.min_shape, std::sin(angle * degree), 1e-14);
      EXPECT_NEAR(report.volume, 6.0, 1e-14);
      EXPECT_EQ(angles_in(report), 12);
      if (angle == 90.0) continue;
      EXPECT_EQ(report.angle_histogram[static_cast<std::size_t>(angle / 10.0)], 2);
      EXPECT_EQ(report.angle_histogram[static_cast<std::size_t>((180.0 - angle) / 10.0)], 2);
    }
  }
}

/// A cube with one corner drawn out along z, by as much as its edge: three of its faces are warped. At the
/// four edges of the top the half planes open by 90 degrees at one end; at the other by arccos(1 / sqrt 3) at
/// the two that meet in the corner, by 135 degrees at the two that do not. Each counts by its mean.
TEST(Quality, WarpedHexahedron) {
  Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(1, 1, 1), {1, 1, 1}}, ElementType::hex8);
  for (Vec3& x : mesh.nodes) {
    if (x == Vec3(1, 1, 1)) x.z() = 2.0;
  }
  const QualityReport report = measure_quality(mesh);
  EXPECT_NEAR(report.min_angle, 0.5 * (90.0 + std::acos(1.0 / std::sqrt(3.0)) / degree), 1e-12);
  EXPECT_NEAR(report.max_angle, 0.5 * (90.0 + 135.0), 1e-12);
  EXPECT_EQ(report.angle_histogram[7], 2);
  EXPECT_EQ(report.angle_histogram[9], 8);
  EXPECT_EQ(report.angle_histogram[11], 2);
}

/// A frustum: the sides of the square lean by the same angle; its faces are plane, so both ends agree.
TEST(Quality, FrustumAndWorstHexahedron) {
  Mesh mesh = generate(BoxShape{Vec3(-1, -1, 0), Vec3(2, 2, 4), {1, 1, 2}}, ElementType::hex8);
  for (std::size_t node = 8; node < 12; ++node) mesh.nodes[node].head<2>() *= 0.5;
  const QualityReport report = measure_quality(mesh);
  EXPECT_EQ(report.worst_element, 1);
  EXPECT_LT((report.worst_centroid - Vec3(0, 0, 3)).norm(), 1e-15);
  const double lean = std::atan2(2.0, 0.5) / degree;  // between base and side
  // Between two leaning sides: their normals (2, 0, 0.5) and (0, 2, 0.5).
  const double between = 180.0 - std::acos(0.25 / 4.25) / degree;
  EXPECT_NEAR(report.min_angle, lean, 1e-12);
  EXPECT_NEAR(report.max_angle, 180.0 - lean, 1e-12);
  EXPECT_NEAR(between, 93.37, 0.01);
  EXPECT_EQ(report.angle_histogram[7], 4);
  EXPECT_EQ(report.angle_histogram[8] + report.angle_histogram[9], 12 + 4);  // the other element's are 90
  EXPECT_EQ(report.angle_histogram[10], 4);
}

}  // namespace
}  // namespace palpate::quality_test
