// Measures of plane meshes for the geometry tests, by other routes than the mesher's own.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "meshes/mesh.h"

namespace palpate::testing {

/// Area with sign of a closed line (shoelace).
inline double signed_area(const std::vector<Vec3>& line) {
  double sum = 0.0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vec3 &a = line[i], &b = line[(i + 1) % line.size()];
    sum += 0.5 * (a[0] * b[1] - a[1] * b[0]);
  }
  return sum;
}

/// Corners of triangle e.
inline std::vector<Vec3> triangle(const Mesh& mesh, Index e) {
  std::vector<Vec3> corners;
  for (const Index node : mesh.element_nodes(e)) {
    corners.push_back(mesh.nodes.at(static_cast<std::size_t>(node)));
  }
  return corners;
}

inline double area(const Mesh& mesh) {
  double sum = 0.0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    sum += signed_area(triangle(mesh, e));
  }
  return sum;
}

/// Smallest angle of a triangle [degree].
inline double smallest_angle(const std::vector<Vec3>& corners) {
  double smallest = 180.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 u = corners[(i + 1) % 3] - corners[i], v = corners[(i + 2) % 3] - corners[i];
    smallest = std::min(smallest, std::acos(u.dot(v) / u.norm() / v.norm()) * 180.0 / std::numbers::pi);
  }
  return smallest;
}

/// Smallest angle of each triangle [degree].
inline std::vector<double> smallest_angles(const Mesh& mesh) {
  std::vector<double> angles;
  angles.reserve(static_cast<std::size_t>(mesh.elements()));
  for (Index e = 0; e < mesh.elements(); ++e) {
    angles.push_back(smallest_angle(triangle(mesh, e)));
  }
  return angles;
}

inline double least(const std::vector<double>& values) {
  return *std::min_element(values.begin(), values.end());
}

inline double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) {
    sum += value;
  }
  return sum / static_cast<double>(values.size());
}

/// Edge of a plane mesh.
struct PlaneEdge {
  Vec3 from, to;
  bool is_boundary;

  [[nodiscard]] double length() const { return (to - from).norm(); }
  [[nodiscard]] Vec3 middle() const { return (from + to) / 2.0; }
};

inline std::vector<PlaneEdge> edges_of(const Mesh& mesh) {
  std::map<std::pair<Index, Index>, int> uses;
  for (Index e = 0; e < mesh.elements(); ++e) {
    const auto nodes = mesh.element_nodes(e);
    for (std::size_t i = 0; i < 3; ++i) {
      ++uses[std::minmax(nodes[i], nodes[(i + 1) % 3])];
    }
  }
  std::vector<PlaneEdge> edges;
  for (const auto& [ends, count] : uses) {
    EXPECT_LE(count, 2);
    edges.push_back({mesh.nodes.at(static_cast<std::size_t>(ends.first)),
                     mesh.nodes.at(static_cast<std::size_t>(ends.second)), count == 1});
  }
  return edges;
}

/// Lengths of the boundary's or of the inner edges.
inline std::vector<double> edge_lengths(const Mesh& mesh, bool boundary) {
  std::vector<double> lengths;
  for (const PlaneEdge& edge : edges_of(mesh)) {
    if (edge.is_boundary == boundary) {
      lengths.push_back(edge.length());
    }
  }
  return lengths;
}

/// Expects counter-clockwise triangles in z = 0 that use every node and leave that many holes (Euler: nodes
/// - edges + triangles = 1 - holes).
inline void expect_plane_mesh(const Mesh& mesh, int holes) {
  ASSERT_EQ(mesh.element, ElementType::tri3);
  ASSERT_EQ(mesh.regions.size(), static_cast<std::size_t>(mesh.elements()));
  std::vector<bool> used(mesh.nodes.size());
  for (Index e = 0; e < mesh.elements(); ++e) {
    EXPECT_GT(signed_area(triangle(mesh, e)), 0.0) << "element " << e;
    EXPECT_EQ(mesh.regions[static_cast<std::size_t>(e)], 0);
    for (const Index node : mesh.element_nodes(e)) {
      used.at(static_cast<std::size_t>(node)) = true;
    }
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
  for (const Vec3& x : mesh.nodes) {
    EXPECT_EQ(x[2], 0.0);
  }
  const auto euler = static_cast<int>(mesh.nodes.size()) - static_cast<int>(edges_of(mesh).size()) +
                     static_cast<int>(mesh.elements());
  EXPECT_EQ(euler, 1 - holes);
}

}  // namespace palpate::testing
