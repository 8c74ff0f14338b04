// Surfaces on their way from a child process.
#pragma once

#include "base/child_process.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Appends a surface, for take_surface.
inline void append_surface(Bytes& bytes, const TriangleSurface& surface) {
  append_array(bytes, std::span(surface.nodes));
  append_array(bytes, std::span(surface.triangles));
}

/// Takes a surface from the front of `bytes`. Throws Error where they do not hold one.
inline TriangleSurface take_surface(std::span<const std::byte>& bytes) {
  TriangleSurface surface;
  surface.nodes = take_array<Vec3>(bytes);
  surface.triangles = take_array<Triangle>(bytes);
  return surface;
}

}  // namespace palpate
