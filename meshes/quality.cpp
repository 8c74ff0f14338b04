#include "meshes/quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "meshes/tet4.h"

namespace palpate {
namespace {

constexpr std::array<std::array<Eigen::Index, 2>, 6> edges = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// Angles between faces [degree]; the gradients of the shape functions are the faces' inward normals.
std::array<double, 6> dihedral_angles(const tet4::Gradients& g) {
  std::array<double, 6> angles{};
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Vec3 a = g.row(edges[e][0]), b = g.row(edges[e][1]);
    angles[e] = std::atan2(a.cross(b).norm(), -a.dot(b)) * 180.0 / std::numbers::pi;
  }
  return angles;
}

/// 3 r_in / R_circum. r_in = 1 / sum |grad N_i|; R from the products of opposite edges (Crelle's formula).
double radius_ratio(const tet4::Corners& x, const tet4::Gradients& g, double volume) {
  const double inradius = 1.0 / g.rowwise().norm().sum();
  const auto length = [&](Eigen::Index i, Eigen::Index j) { return (x.col(i) - x.col(j)).norm(); };
  const double p = length(0, 1) * length(2, 3), q = length(0, 2) * length(1, 3),
               r = length(0, 3) * length(1, 2);
  const double heron = (p + q + r) * (-p + q + r) * (p - q + r) * (p + q - r);
  const double circumradius = std::sqrt(std::max(heron, 0.0)) / (24.0 * volume);
  return 3.0 * inradius / circumradius;
}

}  // namespace

QualityReport measure_quality(const Mesh& mesh) {
  QualityReport report;
  report.min_dihedral = report.min_radius_ratio = report.min_edge = std::numeric_limits<double>::infinity();
  for (std::size_t element = 0; element < mesh.tets.size(); ++element) {
    const tet4::Corners x = tet4::corners(mesh, mesh.tets[element]);
    const tet4::Gradients g = tet4::gradients(x);
    const double volume = tet4::volume(x), ratio = radius_ratio(x, g, volume);
    for (const double angle : dihedral_angles(g)) {
      report.min_dihedral = std::min(report.min_dihedral, angle);
      report.max_dihedral = std::max(report.max_dihedral, angle);
      ++report.dihedral_histogram[static_cast<std::size_t>(
          std::clamp(angle / 10.0, 0.0, QualityReport::bins - 1.0))];
    }
    for (const auto& edge : edges) {
      const double length = (x.col(edge[0]) - x.col(edge[1])).norm();
      report.min_edge = std::min(report.min_edge, length);
      report.max_edge = std::max(report.max_edge, length);
    }
    if (ratio < report.min_radius_ratio) {
      report.min_radius_ratio = ratio;
      report.worst_element = static_cast<Index>(element);
      report.worst_centroid = x.rowwise().mean();
    }
    report.volume += volume;
    report.mean_radius_ratio += ratio / static_cast<double>(mesh.tets.size());
  }
  return report;
}

}  // namespace palpate
