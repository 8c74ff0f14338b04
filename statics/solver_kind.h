// How the equations of an implicit step are solved.
#pragma once

#include <cstdint>

namespace palpate {

enum class SolverKind : std::uint8_t {
  factor,              ///< L L^T of each matrix, the order of elimination found once
  conjugate_gradient,  ///< conjugate gradients, preconditioned by the factor of an older matrix
};

/// The names that users give: factor, cg.
constexpr const char* name_of(SolverKind kind) noexcept {
  return kind == SolverKind::factor ? "factor" : "cg";
}

}  // namespace palpate
