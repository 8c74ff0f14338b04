// Small bodies for the runtime's tests, baked in memory by dense algebra: a second route beside
// palpate-precompute.
#pragma once

#include <Eigen/Core>
#include <array>

#include "formats/model.h"

namespace palpate::test {

/// K [3N x 3N] of all nodes, dense, without boundary conditions [N/m].
Eigen::MatrixXd assemble_stiffness(const Mesh& mesh, const Material& material);

/// The lower triangle of a symmetric matrix.
PackedGreens pack(const Eigen::MatrixXd& matrix, Precision precision);

/// A symmetric positive definite matrix with a dominant diagonal, the same for the same seed.
Eigen::MatrixXd random_definite(Eigen::Index order, unsigned seed);

/// The unit cube of cells^3 cells, E = 1 Pa, nu = 0.3, clamped at z = 0; stored nodes in a scrambled order.
Model box_model(int cells, Scope scope, Precision precision);

}  // namespace palpate::test
