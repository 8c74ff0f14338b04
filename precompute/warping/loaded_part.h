// Place and direction of a study's load.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "precompute/description/description.h"

namespace palpate {

/// Free nodes of the surface that `where` selects; without it those at the free end, whose distance from held
/// nodes is at least 0.95 of the largest. Throws Error (where = `place`) if there are none.
std::vector<Index> loaded_nodes(const Model& model, const std::optional<Selection>& where,
                                const std::string& place);

/// Direction, a unit vector, of the part's largest compliance: `softness` [3 x 3] maps a force on it to its
/// mean displacement. If several are alike, the softest axis among them, z before y before x.
Vec3 softest_direction(const Mat3& softness, int dimension);

}  // namespace palpate
