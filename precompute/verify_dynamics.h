// Dynamics in `palpate-precompute verify`.
#pragma once

#include <vector>

#include "precompute/numerics/assembly.h"
#include "precompute/verify_matrix.h"

namespace palpate {

/// Checks the dynamics of a model that has them, with a newly assembled M. Packed:
/// - inverse columns, rows and touches of K_bar^-1: see verify_matrix;
/// - mass, damping: M and C_d against those of the mesh, relative to the largest entry.
/// Modal (all modes if every free dof is stored, else some, whose interior is solved from (K - omega^2 M)_aa
/// u_a = -(K - omega^2 M)_ab u_b):
/// - modes: |K phi - omega^2 M phi|_max / |K phi|_max;
/// - modal mass: phi_i^T M phi_j - delta_ij;
/// - mode count: no mode of a lower frequency is missing, by the inertia of K - s M.
std::vector<Check> verify_dynamics(const Model& model, const Stiffness& stiffness, int samples);

}  // namespace palpate
