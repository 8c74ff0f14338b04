#include "meshes/element.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <vector>

namespace palpate {
namespace {

using Corner = std::array<double, 3>;

/// Signs of the reference coordinates of the nodes of the [-1, 1]^d elements.
constexpr std::array<Corner, 2> line_corners = {{{-1, 0, 0}, {1, 0, 0}}};
constexpr std::array<Corner, 4> quad_corners = {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}};
constexpr std::array<Corner, 8> hex_corners = {
    {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}};

/// The two corners on either side of each middle node, in VTK's order.
constexpr std::array<std::array<int, 2>, 3> triangle_middles = {{{0, 1}, {1, 2}, {2, 0}}};
constexpr std::array<std::array<int, 2>, 6> tet_middles = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

std::span<const Corner> tensor_corners(ElementType type) {
  if (type == ElementType::line2) return line_corners;
  if (type == ElementType::quad4) return quad_corners;
  return hex_corners;
}

std::span<const std::array<int, 2>> middles(ElementType type) {
  if (type == ElementType::tri6) return triangle_middles;
  if (type == ElementType::tet10) return tet_middles;
  return {};
}

bool is_tensor(ElementType type) {
  return type == ElementType::line2 || type == ElementType::quad4 || type == ElementType::hex8;
}

/// Barycentric coordinates of the unit simplex and their constant gradients.
ShapeValues barycentric(int dimension, const Vec3& xi) {
  ShapeValues L(dimension + 1);
  L.tail(dimension) = xi.head(dimension);
  L[0] = 1.0 - xi.head(dimension).sum();
  return L;
}

ShapeGradients barycentric_gradients(int dimension) {
  ShapeGradients g = ShapeGradients::Zero(dimension + 1, dimension);
  g.row(0).setConstant(-1.0);
  g.bottomRows(dimension).setIdentity();
  return g;
}

std::vector<QuadraturePoint> tensor_rule(int dimension) {
  const double g = 1.0 / std::sqrt(3.0);
  std::vector<QuadraturePoint> rule;
  for (const double z : {-g, g}) {
    for (const double y : {-g, g}) {
      for (const double x : {-g, g}) rule.push_back({{x, dimension > 1 ? y : 0, dimension > 2 ? z : 0}, 1.0});
      if (dimension < 2) return rule;
    }
    if (dimension < 3) return rule;
  }
  return rule;
}

/// Three points, exact to degree 2 (Strang and Fix).
std::vector<QuadraturePoint> triangle_rule() {
  constexpr double a = 1.0 / 6.0, b = 2.0 / 3.0;
  return {{{a, a, 0}, a}, {{b, a, 0}, a}, {{a, b, 0}, a}};
}

/// Four points, exact to degree 2 (Hammer and Stroud 1956).
std::vector<QuadraturePoint> tet_rule() {
  const double a = (5.0 - std::sqrt(5.0)) / 20.0, b = 1.0 - 3.0 * a;
  constexpr double w = 1.0 / 24.0;
  return {{{a, a, a}, w}, {{b, a, a}, w}, {{a, b, a}, w}, {{a, a, b}, w}};
}

std::vector<QuadraturePoint> make_rule(ElementType type) {
  switch (type) {
    case ElementType::tri3:
      return {{{1.0 / 3.0, 1.0 / 3.0, 0.0}, 0.5}};
    case ElementType::tri6:
      return triangle_rule();
    case ElementType::tet4:
    case ElementType::tet4a:
      return {{{0.25, 0.25, 0.25}, 1.0 / 6.0}};
    case ElementType::tet10:
      return tet_rule();
    default:
      return tensor_rule(traits(type).dimension);
  }
}

std::vector<Vec3> make_nodes(ElementType type) {
  std::vector<Vec3> nodes;
  if (is_tensor(type)) {
    for (const Corner& c : tensor_corners(type)) nodes.emplace_back(c[0], c[1], c[2]);
    return nodes;
  }
  nodes.push_back(Vec3::Zero());
  for (int axis = 0; axis < traits(type).dimension; ++axis) nodes.push_back(Vec3::Unit(axis));
  for (const auto& [a, b] : middles(type)) {
    nodes.emplace_back((nodes[static_cast<std::size_t>(a)] + nodes[static_cast<std::size_t>(b)]) / 2.0);
  }
  return nodes;
}

/// Adds the points whose barycentric coordinates are all `a` except one, or (`pairs`) except two that are
/// 1/2 - a.
void add_orbit(std::vector<QuadraturePoint>& rule, double a, double weight, bool pairs) {
  for (int i = 0; i < 4; ++i) {
    for (int j = pairs ? i + 1 : i; j < (pairs ? 4 : i + 1); ++j) {
      std::array<double, 4> L{a, a, a, a};
      L[static_cast<std::size_t>(i)] = L[static_cast<std::size_t>(j)] = pairs ? 0.5 - a : 1.0 - 3.0 * a;
      rule.push_back({Vec3(L[1], L[2], L[3]), weight});
    }
  }
}

/// Quadrature that integrates N_i N_j exactly: degree 2 for tri3 and tet4, degree 5 for tet10 (Walkington
/// 2000, 14 points); for quad4 and hex8 the points of the stiffness suffice.
std::vector<QuadraturePoint> make_mass_rule(ElementType type) {
  std::vector<QuadraturePoint> rule;
  if (type == ElementType::tri3) {
    for (const Vec3& xi : {Vec3(0.5, 0.0, 0.0), Vec3(0.5, 0.5, 0.0), Vec3(0.0, 0.5, 0.0)})
      rule.push_back({xi, 1.0 / 6.0});
  } else if (type == ElementType::tet4 || type == ElementType::tet4a) {
    add_orbit(rule, (5.0 - std::sqrt(5.0)) / 20.0, 1.0 / 24.0, false);
  } else if (type == ElementType::tet10) {
    add_orbit(rule, 0.09273525031089123, 0.01224884051939366, false);
    add_orbit(rule, 0.31088591926330061, 0.01878132095300264, false);
    add_orbit(rule, 0.04550370412564965, 0.007091003462846911, true);
  } else {
    rule = make_rule(type);
  }
  return rule;
}

template <class T>
using PerType = std::array<std::vector<T>, element_traits.size()>;

template <class T, class Make>
PerType<T> for_all_types(Make make) {
  PerType<T> all;
  for (const ElementTraits& t : element_traits) all[static_cast<std::size_t>(t.type)] = make(t.type);
  return all;
}

/// dx/dxi [3, reference dimension] at xi.
Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> jacobian(ElementType type, const ElementNodes& x,
                                                           const Vec3& xi) {
  return x.transpose() * reference_gradients(type, xi);
}

std::span<const QuadraturePoint> mass_quadrature(ElementType type) {
  static const auto rules = for_all_types<QuadraturePoint>(make_mass_rule);
  return rules[static_cast<std::size_t>(type)];
}

double determinant(ElementType type, const ElementNodes& x, const Vec3& xi) {
  const int d = traits(type).dimension;
  const auto J = jacobian(type, x, xi);
  return d == 2 ? J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0) : Mat3(J).determinant();
}

}  // namespace

ShapeValues shape_functions(ElementType type, const Vec3& xi) {
  const ElementTraits& t = traits(type);
  ShapeValues N(t.nodes);
  if (is_tensor(type)) {
    const std::span<const Corner> corners = tensor_corners(type);
    for (int i = 0; i < t.nodes; ++i) {
      double product = 1.0;
      for (int k = 0; k < t.dimension; ++k) {
        product *= (1.0 + corners[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] * xi[k]) / 2.0;
      }
      N[i] = product;
    }
    return N;
  }
  ShapeValues L = barycentric(t.dimension, xi);
  if (t.nodes == t.corners) return L;
  for (int i = 0; i < t.corners; ++i) N[i] = L[i] * (2.0 * L[i] - 1.0);
  int node = t.corners;
  for (const auto& [a, b] : middles(type)) N[node++] = 4.0 * L[a] * L[b];
  return N;
}

ShapeGradients reference_gradients(ElementType type, const Vec3& xi) {
  const ElementTraits& t = traits(type);
  ShapeGradients g(t.nodes, t.dimension);
  if (is_tensor(type)) {
    const std::span<const Corner> corners = tensor_corners(type);
    for (int i = 0; i < t.nodes; ++i) {
      const Corner& c = corners[static_cast<std::size_t>(i)];
      for (int derived = 0; derived < t.dimension; ++derived) {
        double product = 1.0;
        for (int k = 0; k < t.dimension; ++k) {
          const double sign = c[static_cast<std::size_t>(k)];
          product *= (k == derived ? sign : 1.0 + sign * xi[k]) / 2.0;
        }
        g(i, derived) = product;
      }
    }
    return g;
  }
  ShapeGradients dL = barycentric_gradients(t.dimension);
  if (t.nodes == t.corners) return dL;
  const ShapeValues L = barycentric(t.dimension, xi);
  for (int i = 0; i < t.corners; ++i) g.row(i) = (4.0 * L[i] - 1.0) * dL.row(i);
  int node = t.corners;
  for (const auto& [a, b] : middles(type)) g.row(node++) = 4.0 * (L[a] * dL.row(b) + L[b] * dL.row(a));
  return g;
}

std::span<const QuadraturePoint> quadrature(ElementType type) {
  static const auto rules = for_all_types<QuadraturePoint>(make_rule);
  return rules[static_cast<std::size_t>(type)];
}

std::span<const Vec3> reference_nodes(ElementType type) {
  static const auto nodes = for_all_types<Vec3>(make_nodes);
  return nodes[static_cast<std::size_t>(type)];
}

ElementNodes positions(const Mesh& mesh, std::span<const Index> nodes) {
  ElementNodes x(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    x.row(static_cast<Eigen::Index>(i)) = mesh.nodes[static_cast<std::size_t>(nodes[i])].transpose();
  }
  return x;
}

ElementNodes element_nodes(const Mesh& mesh, Index e) {
  return positions(mesh, mesh.element_nodes(e));
}

MappedGradients mapped_gradients(ElementType type, const ElementNodes& x, const Vec3& xi) {
  const int d = traits(type).dimension;
  const ShapeGradients reference = reference_gradients(type, xi);
  MappedGradients mapped;
  if (d == 2) {
    const Eigen::Matrix2d J = (x.transpose() * reference).topRows<2>();
    mapped = {reference * J.inverse(), J.determinant()};
  } else {
    const Mat3 J = x.transpose() * reference;
    mapped = {reference * J.inverse(), J.determinant()};
  }
  return mapped;
}

double facet_measure(ElementType type, const ElementNodes& x, const Vec3& xi) {
  const auto J = jacobian(type, x, xi);
  if (J.cols() == 1) return Vec3(J.col(0)).norm();
  return Vec3(J.col(0)).cross(Vec3(J.col(1))).norm();
}

double element_volume(ElementType type, const ElementNodes& x) {
  double volume = 0.0;
  for (const QuadraturePoint& q : quadrature(type)) volume += q.weight * determinant(type, x, q.xi);
  return volume;
}

double smallest_determinant(ElementType type, const ElementNodes& x) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const QuadraturePoint& q : quadrature(type)) smallest = std::min(smallest, determinant(type, x, q.xi));
  const std::span<const Vec3> corners =
      reference_nodes(type).first(static_cast<std::size_t>(traits(type).corners));
  for (const Vec3& xi : corners) smallest = std::min(smallest, determinant(type, x, xi));
  return smallest;
}

StrainMatrix strain_matrix(const ShapeGradients& gradients) {
  const Eigen::Index d = gradients.cols();
  StrainMatrix B = StrainMatrix::Zero(d == 2 ? 3 : 6, d * gradients.rows());
  for (Eigen::Index i = 0; i < gradients.rows(); ++i) {
    const double x = gradients(i, 0), y = gradients(i, 1);
    if (d == 2) {
      B.middleCols(2 * i, 2) << x, 0,  //
          0, y,                        //
          y, x;
      continue;
    }
    const double z = gradients(i, 2);
    B.middleCols(3 * i, 3) << x, 0, 0,  //
        0, y, 0,                        //
        0, 0, z,                        //
        y, x, 0,                        //
        0, z, y,                        //
        z, 0, x;
  }
  return B;
}

ElementMatrix element_stiffness(ElementType type, const ElementNodes& x, const ElasticityMatrix& D,
                                double thickness) {
  const Eigen::Index dofs = x.rows() * traits(type).dimension;
  ElementMatrix K = ElementMatrix::Zero(dofs, dofs);
  for (const QuadraturePoint& q : quadrature(type)) {
    const MappedGradients mapped = mapped_gradients(type, x, q.xi);
    const StrainMatrix B = strain_matrix(mapped.gradients);
    const StrainMatrix DB = D * B;
    K.noalias() += (q.weight * thickness * mapped.determinant) * B.transpose().lazyProduct(DB);
  }
  return K;
}

ElementMass element_mass(ElementType type, const ElementNodes& x, double density, double thickness) {
  ElementMass M = ElementMass::Zero(x.rows(), x.rows());
  for (const QuadraturePoint& q : mass_quadrature(type)) {
    const ShapeValues N = shape_functions(type, q.xi);
    M.noalias() +=
        (q.weight * density * thickness * determinant(type, x, q.xi)) * N.lazyProduct(N.transpose());
  }
  return M;
}

ShapeValues element_lumped_mass(ElementType type, const ElementNodes& x, double density, double thickness) {
  const ElementMass M = element_mass(type, x, density, thickness);
  return M.diagonal() * (M.sum() / M.trace());
}

ElementVector element_stress_force(ElementType type, const ElementNodes& x, const StressVector& stress,
                                   double thickness) {
  ElementVector f = ElementVector::Zero(x.rows() * traits(type).dimension);
  for (const QuadraturePoint& q : quadrature(type)) {
    const MappedGradients mapped = mapped_gradients(type, x, q.xi);
    f += q.weight * thickness * mapped.determinant * strain_matrix(mapped.gradients).transpose() * stress;
  }
  return f;
}

ShapeValues element_shape_integrals(ElementType type, const ElementNodes& x, double thickness) {
  ShapeValues integrals = ShapeValues::Zero(x.rows());
  for (const QuadraturePoint& q : quadrature(type)) {
    integrals += q.weight * thickness * determinant(type, x, q.xi) * shape_functions(type, q.xi);
  }
  return integrals;
}

ShapeValues facet_shape_integrals(ElementType type, const ElementNodes& x, double thickness) {
  ShapeValues integrals = ShapeValues::Zero(x.rows());
  for (const QuadraturePoint& q : quadrature(type)) {
    integrals += q.weight * thickness * facet_measure(type, x, q.xi) * shape_functions(type, q.xi);
  }
  return integrals;
}

}  // namespace palpate
