// Touches by which stored Green's functions are judged: some nodes are displaced, and their forces compared.
#pragma once

#include <Eigen/Core>
#include <random>
#include <span>

#include "meshes/mesh.h"
#include "precompute/numerics/refined_solve.h"

namespace palpate {

/// In [-1, 1), the same on every machine.
double uniform(std::mt19937_64& random);

/// Displacements [d m, d + 3] of m nodes, one a column: along each axis, by a linear field, and twice at
/// random. `arms` [m] are the nodes from the first one [m].
Eigen::MatrixXd touch_displacements(std::span<const Vec3> arms, int d, std::mt19937_64& random);

/// max |f - f_0| / max |f_0| over the nodes and displacements, f = C^-1 u and f_0 = reference^-1 u; infinity
/// where C is not positive definite. Of the nodes that u is about, the first ones of both matrices.
double touch_error(const RefinedSolution::Refined& reference, const Eigen::MatrixXd& C,
                   const Eigen::MatrixXd& u, int d);

}  // namespace palpate
