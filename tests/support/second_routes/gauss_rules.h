// Quadrature of the tests' own, of any order, to check the elements' rules and integrals against.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>
#include <vector>

#include "meshes/element.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::test {

/// Reference element is the unit simplex, and not [-1, 1]^d.
inline bool is_simplex(ElementType type) {
  return traits(type).dimension > 1 && traits(type).corners == traits(type).dimension + 1;
}

/// Points and weights of the n-point Gauss rule on [0, 1], exact to degree 2n - 1: eigenvalues and vectors of
/// the Jacobi matrix of the Legendre polynomials (Golub and Welsch 1969).
inline std::vector<std::pair<double, double>> gauss_legendre(int n) {
  Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(n, n);
  for (int k = 1; k < n; ++k) jacobi(k, k - 1) = k / std::sqrt(4.0 * k * k - 1.0);
  const Eigenpairs pairs = eigenpairs_of(jacobi);
  std::vector<std::pair<double, double>> rule;
  rule.reserve(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) {
    rule.emplace_back((1.0 + pairs.values[k]) / 2.0, std::pow(pairs.vectors(0, k), 2));
  }
  return rule;
}

/// Rule with n^d points: a product of Gauss rules, exact to degree 2n - 1 in each coordinate; on simplices
/// the cube collapsed onto the simplex (Duffy 1982), exact to total degree 2n - d.
inline std::vector<QuadraturePoint> gauss_rule(ElementType type, int n) {
  const int d = traits(type).dimension;
  const std::vector<std::pair<double, double>> line = gauss_legendre(n);
  std::vector<QuadraturePoint> rule{{Vec3::Zero(), 1.0}};
  for (int axis = 0; axis < d; ++axis) {
    std::vector<QuadraturePoint> longer;
    for (const QuadraturePoint& q : rule) {
      for (const auto& [s, weight] : line) {
        longer.push_back({q.xi + s * Vec3::Unit(axis), q.weight * weight});
      }
    }
    rule = std::move(longer);
  }
  for (QuadraturePoint& q : rule) {
    if (!is_simplex(type)) {
      q.weight *= std::pow(2.0, d);
      q.xi.head(d) = 2.0 * q.xi.head(d).array() - 1.0;
      continue;
    }
    double room = 1.0;  // what the coordinates so far leave of 1
    for (int axis = 0; axis < d; ++axis) {
      q.weight *= room;
      q.xi[axis] *= room;
      room -= q.xi[axis];
    }
  }
  return rule;
}

}  // namespace palpate::test
