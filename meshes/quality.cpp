#include "meshes/quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

using Angles = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 12, 1>;

/// Angles of an element [degree] and its shape.
struct ElementQuality {
  Angles angles;
  double shape;
};

Vec3 node(const ElementNodes& x, Eigen::Index i) {
  return x.row(i).transpose();
}

/// Angle between two directions [degree], from 0 to 180.
double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

/// Angle between the half planes that leave the direction `edge` towards a and b: the dihedral angle.
double angle_about(const Vec3& edge, const Vec3& a, const Vec3& b) {
  return angle_between(edge.cross(a), edge.cross(b));
}

/// Quality of a triangle: corner angles, and 2 r_in / R_circum = 16 A^2 / (a b c (a + b + c)).
ElementQuality triangle_quality(const ElementNodes& x) {
  ElementQuality quality{Angles(3), 0.0};
  double perimeter = 0.0, product = 1.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Vec3 next = node(x, (i + 1) % 3) - node(x, i), last = node(x, (i + 2) % 3) - node(x, i);
    quality.angles[i] = angle_between(next, last);
    perimeter += next.norm();
    product *= next.norm();
  }
  const double doubled_area = (node(x, 1) - node(x, 0)).cross(node(x, 2) - node(x, 0)).norm();
  quality.shape = 4.0 * doubled_area * doubled_area / (product * perimeter);
  return quality;
}

/// Quality of a quadrilateral: corner angles, and the smallest sine of them, negative beyond 180 degrees.
ElementQuality quad_quality(const ElementNodes& x) {
  ElementQuality quality{Angles(4), std::numeric_limits<double>::infinity()};
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Vec3 next = node(x, (i + 1) % 4) - node(x, i), last = node(x, (i + 3) % 4) - node(x, i);
    quality.angles[i] = angle_between(next, last);
    quality.shape = std::min(quality.shape, next.normalized().cross(last.normalized()).z());
  }
  return quality;
}

/// Radius ratio 3 r_in / R_circum. r_in = 3 V / (sum of the faces' areas); R from the products of opposite
/// edges (Crelle's formula).
double tet_radius_ratio(const ElementNodes& x) {
  const auto length = [&](Eigen::Index i, Eigen::Index j) { return (x.row(i) - x.row(j)).norm(); };
  const auto doubled_area = [&](Eigen::Index i, Eigen::Index j, Eigen::Index k) {
    return (node(x, j) - node(x, i)).cross(node(x, k) - node(x, i)).norm();
  };
  const double volume_6 =
      (node(x, 1) - node(x, 0)).cross(node(x, 2) - node(x, 0)).dot(node(x, 3) - node(x, 0));
  const double inradius = volume_6 / (doubled_area(1, 2, 3) + doubled_area(0, 2, 3) + doubled_area(0, 1, 3) +
                                      doubled_area(0, 1, 2));
  const double p = length(0, 1) * length(2, 3), q = length(0, 2) * length(1, 3),
               r = length(0, 3) * length(1, 2);
  const double heron = (p + q + r) * (-p + q + r) * (p - q + r) * (p + q - r);
  const double circumradius = std::sqrt(std::max(heron, 0.0)) / (4.0 * volume_6);
  return 3.0 * inradius / circumradius;
}

ElementQuality tet_quality(const ElementNodes& x) {
  // Ends of each edge, and the two corners that are not on it.
  static constexpr std::array<std::array<Eigen::Index, 4>, 6> edges = {
      {{0, 1, 2, 3}, {1, 2, 0, 3}, {2, 0, 1, 3}, {0, 3, 1, 2}, {1, 3, 0, 2}, {2, 3, 0, 1}}};
  ElementQuality quality{Angles(6), tet_radius_ratio(x)};
  Eigen::Index e = 0;
  for (const auto& [i, j, k, l] : edges) {
    quality.angles[e++] =
        angle_about(node(x, j) - node(x, i), node(x, k) - node(x, i), node(x, l) - node(x, i));
  }
  return quality;
}

/// Quality of a hexahedron: dihedral angles at the edges, the mean of both ends (faces may be warped), and
/// the smallest determinant of the three unit edges at a corner.
ElementQuality hex_quality(const ElementNodes& x) {
  static constexpr std::array<std::array<Eigen::Index, 3>, 8> neighbours = {
      {{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7}, {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}}};
  const auto angle_at = [&](Eigen::Index corner, Eigen::Index end) {
    const auto& around = neighbours[static_cast<std::size_t>(corner)];
    const auto place = std::find(around.begin(), around.end(), end) - around.begin();
    const auto other = [&](std::ptrdiff_t step) {
      return Vec3(node(x, around[static_cast<std::size_t>((place + step) % 3)]) - node(x, corner));
    };
    return angle_about(other(0), other(1), other(2));
  };
  ElementQuality quality{Angles(12), std::numeric_limits<double>::infinity()};
  Eigen::Index e = 0;
  for (const auto& [i, j] : element_edges(ElementType::hex8)) {
    quality.angles[e++] = 0.5 * (angle_at(i, j) + angle_at(j, i));
  }
  for (Eigen::Index corner = 0; corner < 8; ++corner) {
    Mat3 edges;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto end = neighbours[static_cast<std::size_t>(corner)][static_cast<std::size_t>(k)];
      edges.col(k) = (node(x, end) - node(x, corner)).normalized();
    }
    quality.shape = std::min(quality.shape, edges.col(0).cross(edges.col(1)).dot(edges.col(2)));
  }
  return quality;
}

ElementQuality element_quality(ElementType type, const ElementNodes& x) {
  switch (type) {
    case ElementType::tri3:
      return triangle_quality(x);
    case ElementType::quad4:
      return quad_quality(x);
    case ElementType::hex8:
      return hex_quality(x);
    default:
      return tet_quality(x);
  }
}

}  // namespace

QualityReport measure_quality(const Mesh& mesh) {
  QualityReport report;
  report.min_angle = report.min_shape = report.min_edge = std::numeric_limits<double>::infinity();
  for (Index e = 0; e < mesh.elements(); ++e) {
    const ElementNodes x = element_nodes(mesh, e);
    const ElementQuality quality = element_quality(mesh.element, x);
    for (const double angle : quality.angles) {
      report.min_angle = std::min(report.min_angle, angle);
      report.max_angle = std::max(report.max_angle, angle);
      ++report.angle_histogram[static_cast<std::size_t>(
          std::clamp(angle / 10.0, 0.0, QualityReport::bins - 1.0))];
    }
    for (const auto& [i, j] : element_edges(mesh.element)) {
      const double length = (x.row(i) - x.row(j)).norm();
      report.min_edge = std::min(report.min_edge, length);
      report.max_edge = std::max(report.max_edge, length);
    }
    if (quality.shape < report.min_shape) {
      report.min_shape = quality.shape;
      report.worst_element = e;
      report.worst_centroid = x.topRows(traits(mesh.element).corners).colwise().mean().transpose();
    }
    report.volume += element_volume(mesh.element, x);
    report.mean_shape += quality.shape / mesh.elements();
  }
  return report;
}

}  // namespace palpate
