// Interfaces between materials inside a body.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// Interfaces between the materials of a body in space, at rest. Its nodes are not those of the surface.
struct InnerSurface {
  std::vector<Vec3> nodes;                      ///< [I] without loads [m]
  std::vector<std::array<Index, 3>> triangles;  ///< [J] outward from `inside`
  std::vector<std::uint8_t> inside;             ///< [J] number of the material on the inner side
  std::vector<std::uint8_t> outside;            ///< [J] number of the material on the outer side
};

/// Returns the number of an element's material in messages: 255 stands for all larger ones.
std::uint8_t material_number(const Model& model, Index element);

/// Builds the facets between elements of two materials; curved and quadrilateral ones become triangles of
/// their corners. Inside is the material of the larger number.
InnerSurface make_inner_surface(const Model& model);

}  // namespace palpate
