// Elements below the contact surface.
#pragma once

#include <vector>

#include "formats/model.h"

namespace palpate {

/// Returns the element [F] of which each simplex of model.surface is a facet or a part of one. Throws Error
/// (where = the model's name) if there is none.
std::vector<Index> surface_elements(const Model& model);

}  // namespace palpate
