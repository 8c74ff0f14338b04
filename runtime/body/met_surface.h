// Fineness of the surface that a tool meets.
#pragma once

#include "formats/model.h"

namespace palpate {

/// The surface that tools meet of a body (see Body).
struct MetSurface {
  int refinement = 1;
  bool is_local = false;
  bool operator==(const MetSurface&) const = default;
};

/// Surface for a tool of this radius [m], for which the mesh of a body of one material is too coarse if its
/// edges are longer than a fifth of it; finer if there will be graded patches.
[[nodiscard]] MetSurface met_surface(const Model& model, double radius, bool has_patches = false);

/// True if a body is in space and as stiff everywhere, so that close to its surface it is a half-space.
[[nodiscard]] bool is_even(const Model& model) noexcept;

}  // namespace palpate
