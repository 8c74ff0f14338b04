// Where materials meet within a body.
#pragma once

#include "formats/model.h"
#include "runtime/scene/scene.h"

namespace palpate {

/// The number of an element's material as messages have it: 255 stands for all beyond.
std::uint8_t material_number(const Model& model, Index element);

/// The sides that elements of two materials share, curved and square ones as triangles of their corners.
/// Inside is the material of the larger number.
InnerSurface make_inner_surface(const Model& model);

}  // namespace palpate
