// Kinds of solvers for the equations of an implicit step.
#pragma once

#include <cstdint>

namespace palpate {

enum class SolverKind : std::uint8_t {
  factor,              ///< L L^T of each matrix, with one elimination order for all
  conjugate_gradient,  ///< conjugate gradients, preconditioned by the factor of an older matrix
};

/// Names of the solvers in options: factor, cg.
constexpr const char* name_of(SolverKind kind) noexcept {
  return kind == SolverKind::factor ? "factor" : "cg";
}

}  // namespace palpate
