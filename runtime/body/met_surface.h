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

/// Surface for a tool of this radius [m], for which a mesh of simplices with longer edges than a fifth of it is
/// too coarse.
[[nodiscard]] MetSurface met_surface(const Model& model, double radius);

}  // namespace palpate
