// What a mesh adds to the force of a small tool.
#pragma once

#include "runtime/body/body.h"
#include "runtime/touch/tool.h"

namespace palpate {

inline constexpr double noticed_stiffening = 1.2;  ///< above it a person is told

/// Force of a press on the body's mesh over that on a smooth body, where `tool` presses the surface in by
/// `depth` [m]: sqrt(1 + (C h / a)^2), with a = sqrt(R depth) the radius of the contact (of a flat disc its
/// own), h the mean edge of the surface and C by kind of element. A touch of one node is linear, F = k delta,
/// and Hertz's is 4/3 E* sqrt(R) delta^1.5: their ratio goes with h / a. Between the two the law was measured
/// on blocks, and fits to 7 % (docs/measurements/accuracy.md). 1 for what has no such radius (a point, a tool
/// that pulls) and in the plane, where nothing was measured.
[[nodiscard]] double mesh_stiffening(const Body& body, const Tool& tool, double depth) noexcept;

}  // namespace palpate
