// Elements for the tests: nodes as VTK numbers them, distorted elements, shapes with a known measure.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <random>
#include <string>
#include <vector>

#include "tests/support/second_routes/gauss_rules.h"

namespace palpate::test {

inline std::string name_of(const testing::TestParamInfo<ElementType>& info) {
  return traits(info.param).name;
}

/// Parametric coordinates of the nodes as VTK's documentation gives them: all in [0, 1].
inline std::vector<Vec3> vtk_nodes(ElementType type) {
  switch (type) {
    case ElementType::line2:
      return {{0, 0, 0}, {1, 0, 0}};
    case ElementType::tri3:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    case ElementType::tri6:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}, {0.5, 0.5, 0}, {0, 0.5, 0}};
    case ElementType::quad4:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    case ElementType::tet4:
    case ElementType::tet4a:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    case ElementType::tet10:
      return {{0, 0, 0},   {1, 0, 0},  {0, 1, 0},  {0, 0, 1},   {.5, 0, 0},
              {.5, .5, 0}, {0, .5, 0}, {0, 0, .5}, {.5, 0, .5}, {0, .5, .5}};
    case ElementType::hex8:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  }
  return {};
}

inline std::vector<Vec3> nodes_in_reference(ElementType type) {
  std::vector<Vec3> nodes = vtk_nodes(type);
  if (is_simplex(type)) return nodes;
  const int d = traits(type).dimension;
  for (Vec3& xi : nodes) xi.head(d) = 2.0 * xi.head(d).array() - 1.0;
  return nodes;
}

/// Points inside of the reference element: those of a rule of 27 or fewer points.
inline std::vector<Vec3> inner_points(ElementType type) {
  std::vector<Vec3> points;
  for (const QuadraturePoint& q : gauss_rule(type, 3)) points.push_back(q.xi);
  return points;
}

/// An affine map of the size of an organ's elements, det > 0.
inline Mat3 some_map() {
  Mat3 A;
  A << 0.03, 0.01, -0.004, -0.006, 0.025, 0.008, 0.005, -0.003, 0.028;
  return A;
}

/// Maps points that lie in VTK's parametric space: into space, or for plane elements into the plane z = 0.
inline ElementNodes mapped(ElementType type, const std::vector<Vec3>& points) {
  ElementNodes x(traits(type).nodes, 3);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    x.row(i) = some_map() * (points[static_cast<std::size_t>(i)] + Vec3(0.5, -0.25, 0.1));
  }
  if (traits(type).dimension == 2) x.col(2).setZero();
  return x;
}

/// An element no two edges of which are parallel: corners moved at random by up to a tenth; further nodes in
/// the middles of their edges, or with `curved` moved too.
inline ElementNodes distorted(ElementType type, bool curved = false) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-0.1, 0.1);
  const std::vector<Vec3> reference = vtk_nodes(type);
  const auto corners = static_cast<std::size_t>(traits(type).corners);
  std::vector<Vec3> moved(reference);
  for (std::size_t i = 0; i < corners; ++i) moved[i] += Vec3(shift(random), shift(random), shift(random));
  for (std::size_t i = corners; i < moved.size(); ++i) {
    moved[i] = Vec3::Zero();  // straight edges: every other node is where the linear simplex takes it
    moved[i] += (1.0 - reference[i].sum()) * moved[0];
    for (std::size_t k = 0; k + 1 < corners; ++k) {
      moved[i] += reference[i][static_cast<Eigen::Index>(k)] * moved[k + 1];
    }
    if (curved) moved[i] += 0.5 * Vec3(shift(random), shift(random), shift(random));
  }
  return mapped(type, moved);
}

struct Shape {
  ElementNodes x;
  double measure;  ///< length, area or volume
  Vec3 centroid;
};

/// Distorted straight-edged elements with measure and centroid by elementary geometry; hex8 is the frustum of
/// a pyramid under an affine map.
inline Shape known_shape(ElementType type) {
  const ElementNodes x = distorted(type);
  const auto node = [&](Eigen::Index i) { return Vec3(x.row(i)); };
  const auto area = [&](int i, int j, int k) {
    return 0.5 * (node(j) - node(i)).cross(node(k) - node(i)).norm();
  };
  const Vec3 mean = x.topRows(traits(type).corners).colwise().mean();
  switch (type) {
    case ElementType::line2:
      return {x, (node(1) - node(0)).norm(), mean};
    case ElementType::tri3:
    case ElementType::tri6:
      return {x, area(0, 1, 2), mean};
    case ElementType::tet4:
    case ElementType::tet4a:
    case ElementType::tet10:
      return {x, (node(1) - node(0)).cross(node(2) - node(0)).dot(node(3) - node(0)) / 6.0, mean};
    case ElementType::quad4: {
      const double first = area(0, 1, 2), second = area(0, 2, 3);
      const Vec3 moment =
          first * (node(0) + node(1) + node(2)) / 3.0 + second * (node(0) + node(2) + node(3)) / 3.0;
      return {x, first + second, moment / (first + second)};
    }
    case ElementType::hex8:
      break;
  }
  const double a = 1.0, b = 0.4, h = 1.2, sum = a * a + a * b + b * b;
  Shape frustum{ElementNodes(8, 3), h / 3.0 * sum * some_map().determinant(),
                some_map() * Vec3(0, 0, h / 4.0 * (a * a + 2.0 * a * b + 3.0 * b * b) / sum)};
  for (Eigen::Index i = 0; i < 8; ++i) {
    const Vec3 corner = vtk_nodes(type)[static_cast<std::size_t>(i)];
    const double side = corner.z() > 0.0 ? b : a;
    frustum.x.row(i) =
        some_map() * Vec3(side * (corner.x() - 0.5), side * (corner.y() - 0.5), h * corner.z());
  }
  return frustum;
}

/// Gradients of the barycentric coordinates: L_i(x) = c_i0 + c_i . x with L_i(x_j) = delta_ij. [d + 1, d]
inline Eigen::MatrixXd barycentric_gradients(const ElementNodes& x, Eigen::Index d) {
  Eigen::MatrixXd A(d + 1, d + 1);
  A << Eigen::VectorXd::Ones(d + 1), x.topLeftCorner(d + 1, d);
  return A.inverse().bottomRows(d).transpose();
}

}  // namespace palpate::test
