// Displacements and stresses of a picture as whole numbers, and what changed of them since another picture.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/scene/scene.h"

namespace palpate {

/// Values at the nodes in units that are powers of two. [n] nodes of the scene in its order, then those of
/// the patch.
struct WireValues {
  std::uint32_t number = 0;  ///< of the picture, from 1 on
  std::uint32_t patch = 0;   ///< 0: none
  std::size_t scene_nodes = 0;
  std::int32_t exponent_u = 0;       ///< displacements are in 2^this [m]
  std::int32_t exponent_stress = 0;  ///< stresses are in 2^this [Pa]
  /// [n] each: along x, y, z, and 1 + von Mises stress, 0 where that is not known
  std::array<std::vector<std::int32_t>, 4> channel;
};

/// Rounds a picture that fits (scene.h). Displacements are off by at most 1/10 000 of the largest component,
/// stresses by 1/8 192 of the largest. What is not finite counts as 0, a stress as not known.
WireValues wire_values(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch,
                       std::uint32_t number);

/// The bits (web/PROTOCOL.md) from which `values` follow where `base` is known; null: where nothing is.
std::string encode_values(const WireValues& values, const WireValues* base);

}  // namespace palpate
