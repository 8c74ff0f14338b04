// Where materials meet within a body.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// Where materials meet within a body in space, at rest. Its nodes are not those of the surface.
struct InnerSurface {
  std::vector<Vec3> nodes;                      ///< [I] without loads [m]
  std::vector<std::array<Index, 3>> triangles;  ///< [J] outward of `inside`
  std::vector<std::uint8_t> inside;             ///< [J] number of the material on the one side
  std::vector<std::uint8_t> outside;            ///< [J] and on the other
};

/// The number of an element's material as messages have it: 255 stands for all beyond.
std::uint8_t material_number(const Model& model, Index element);

/// The sides that elements of two materials share, curved and square ones as triangles of their corners.
/// Inside is the material of the larger number.
InnerSurface make_inner_surface(const Model& model);

}  // namespace palpate
