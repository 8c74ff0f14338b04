// Checks of a polygon before it is meshed.
#pragma once

#include <string>

#include "precompute/description/description.h"

namespace palpate {

/// Throws Error (where = `where`) unless every line has at least three different points, no two edges cross,
/// touch or overlap, and the holes lie side by side within the outer line. The message has coordinates in the
/// polygon's own unit.
void check_polygon(const PolygonGeometry& polygon, const std::string& where);

}  // namespace palpate
