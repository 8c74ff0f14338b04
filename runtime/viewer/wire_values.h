// Displacements and stresses of a picture as integers, and their difference from another picture.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/scene/scene.h"

namespace palpate {

/// Values at the nodes in units that are powers of two. [n] nodes: those of the scene in its order, then
/// those of the patch.
struct WireValues {
  std::uint32_t number = 0;  ///< number of the picture, from 1
  std::uint32_t patch = 0;   ///< number of the patch; 0: none
  std::size_t scene_nodes = 0;
  std::int32_t exponent_u = 0;       ///< displacements are in 2^this [m]
  std::int32_t exponent_stress = 0;  ///< stresses are in 2^this [Pa]
  /// [n] each: x, y, z of the displacement, and 1 + von Mises stress, 0 where unknown
  std::array<std::vector<std::int32_t>, 4> channel;
};

/// Rounds a picture that fits (scene.h). Displacements are accurate to 1/10 000 of the largest component,
/// stresses to 1/8 192 of the largest. Non-finite displacements become 0, non-finite stresses unknown.
WireValues wire_values(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch,
                       std::uint32_t number);

/// Encodes the bits (web/PROTOCOL.md) that give `values` to a reader that has `base`; null: to one that has
/// nothing.
std::string encode_values(const WireValues& values, const WireValues* base);

}  // namespace palpate
