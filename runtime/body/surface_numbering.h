// The elements under the surface that a tool meets.
#pragma once

#include <vector>

#include "formats/model.h"

namespace palpate {

/// The element that each simplex of model.surface is a side, or a part of a side, of. [F] Throws Error (where
/// = the model's name) for a simplex that is none.
std::vector<Index> surface_elements(const Model& model);

}  // namespace palpate
