// Where and along which direction a study loads a body.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "precompute/description/description.h"

namespace palpate {

/// The nodes of the surface that `where` selects and that nothing holds; without it the free end: those at
/// least 0.95 times as far from what is held as the farthest. Throws Error (where = `place`) where there are
/// none.
std::vector<Index> loaded_nodes(const Model& model, const std::optional<Selection>& where,
                                const std::string& place);

/// The direction, a unit vector, along which the part gives way most: `softness` [3 x 3] takes a force on it
/// to its mean displacement. Where several do alike, the axis of them that is softest, z before y before x.
Vec3 softest_direction(const Mat3& softness, int dimension);

}  // namespace palpate
