// Springs along the edges of a mesh, in place of its elements: what other simulators model tissue with.
#pragma once

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "meshes/element.h"
#include "meshes/topology.h"
#include "statics/live_body.h"

namespace palpate::test {

/// A spring between two nodes.
struct Spring {
  Index a, b;
  double stiffness;  ///< force by extension [N/m]
  double length;     ///< at rest [m]
};

/// One spring for each edge of a mesh of tet4, fitted to Young's modulus E [Pa] as Van Gelder (1998) does:
/// k = E sum V_e / L^2 over the elements at the edge. Summed over directions, sum k L^2 is 6 E V, with which
/// a network of all directions has Young's modulus E. Its Poisson's ratio is 1/4: central forces allow no
/// other.
inline std::vector<Spring> fitted_springs(const Mesh& mesh, double E) {
  std::map<std::pair<Index, Index>, double> stiffness;  // times L^2
  for (Index e = 0; e < mesh.elements(); ++e) {
    const double volume = element_volume(mesh.element, element_nodes(mesh, e));
    const std::span<const Index> nodes = mesh.element_nodes(e);
    for (const EdgeNodes& edge : element_edges(mesh.element)) {
      const auto [a, b] = std::minmax(nodes[edge[0]], nodes[edge[1]]);
      stiffness[{a, b}] += E * volume;
    }
  }
  std::vector<Spring> springs;
  for (const auto& [nodes, times_square] : stiffness) {
    const double length = (mesh.nodes[nodes.second] - mesh.nodes[nodes.first]).norm();
    springs.push_back({nodes.first, nodes.second, times_square / (length * length), length});
  }
  return springs;
}

/// Springs at positions x [3 N] of the nodes.
struct SpringForces {
  double energy = 0.0;                          ///< [J]
  Eigen::VectorXd f;                            ///< [3 N] on the nodes [N]
  std::vector<Eigen::Triplet<double>> tangent;  ///< -df/dx without what compressed springs take from it
};

inline SpringForces forces_of(const std::vector<Spring>& springs, const Eigen::VectorXd& x) {
  SpringForces sums;
  sums.f.setZero(x.size());
  for (const Spring& spring : springs) {
    const Eigen::Index a = 3 * Eigen::Index{spring.a}, b = 3 * Eigen::Index{spring.b};
    const Vec3 along = x.segment<3>(b) - x.segment<3>(a), n = along.normalized();
    const double stretch = along.norm() - spring.length;
    sums.energy += 0.5 * spring.stiffness * stretch * stretch;
    sums.f.segment<3>(a) += spring.stiffness * stretch * n;
    sums.f.segment<3>(b) -= spring.stiffness * stretch * n;
    const Mat3 N = n * n.transpose(),
               K = spring.stiffness * (N + std::max(stretch / along.norm(), 0.0) * (Mat3::Identity() - N));
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) {
        for (const auto& [row, column, sign] : {std::tuple(a, a, 1), {b, b, 1}, {a, b, -1}, {b, a, -1}})
          sums.tangent.emplace_back(row + p, column + q, sign * K(p, q));
      }
    }
  }
  return sums;
}

/// Moves the free dofs of a body, whose elements count for nothing, to where springs and `load` [3 N]
/// balance, by Newton's method: the norm of the forces left, of the largest in the way.
inline double find_balance(const std::vector<Spring>& springs, const LiveBody& body,
                           const Eigen::VectorXd& load, Eigen::VectorXd& x) {
  const std::span<const Index> free = body.dof_of_free();
  const auto forces_left = [&](const SpringForces& at) {
    Eigen::VectorXd left(body.free_dofs());
    for (Index k = 0; k < body.free_dofs(); ++k) left[k] = at.f[free[k]] + load[free[k]];
    return left;
  };
  const auto potential = [&](const SpringForces& at, const Eigen::VectorXd& there) {
    return at.energy - load.dot(there - body.rest());
  };
  SpringForces at = forces_of(springs, x);
  double left = 1.0;
  for (int round = 0; round < 200 && left > 1e-9; ++round) {
    std::vector<Eigen::Triplet<double>> entries;
    for (const Eigen::Triplet<double>& entry : at.tangent) {
      const Index row = body.free_of_dof()[static_cast<std::size_t>(entry.row())],
                  column = body.free_of_dof()[static_cast<std::size_t>(entry.col())];
      if (row >= 0 && column >= 0) entries.emplace_back(row, column, entry.value());
    }
    Eigen::SparseMatrix<double> K(body.free_dofs(), body.free_dofs());
    K.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(K);
    const Eigen::VectorXd change = factor.solve(forces_left(at));
    Eigen::VectorXd step = Eigen::VectorXd::Zero(x.size());
    for (Index k = 0; k < body.free_dofs(); ++k) step[free[k]] = change[k];
    const double before = potential(at, x);
    for (int half = 0; half < 20; ++half, step *= 0.5) {
      at = forces_of(springs, x + step);
      if (potential(at, x + step) <= before) break;
    }
    x += step;
    left = forces_left(at).norm() / std::max(at.f.norm(), load.norm());
  }
  return left;
}

}  // namespace palpate::test
