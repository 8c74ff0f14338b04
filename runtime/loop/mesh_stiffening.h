// Stiffening of a small tool's contact by the mesh.
#pragma once

#include "runtime/body/body.h"
#include "runtime/core/touch/tool.h"

namespace palpate {

inline constexpr double noticed_stiffening = 1.2;  ///< a larger one is reported

/// Ratio of a press's force on the body's mesh to that on a smooth body, for `tool` pressing the surface in
/// by `depth` [m]: sqrt(1 + (C h / a)^2), with a = sqrt(R depth) the contact radius (for a flat disc its
/// own), h the mean edge of the surface and C per kind of element. A press on a single node is linear, F = k
/// delta, and Hertz's is 4/3 E* sqrt(R) delta^1.5: their ratio scales with h / a. Between the two the law was
/// measured on blocks and fits to 7 % (docs/measurements/accuracy.md). Returns 1 without such a radius (a
/// point, a tool that pulls) and in the plane, where it was not measured.
[[nodiscard]] double mesh_stiffening(const Body& body, const Tool& tool, double depth) noexcept;

}  // namespace palpate
