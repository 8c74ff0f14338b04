// Largest reach of a body's overlays.
#pragma once

#include "runtime/body/body.h"

namespace palpate {

/// Largest number of rings of any overlay of the body: the number of layers stored below its surface. From 0
/// (no overlays, as of tet4a) to `most_rings`.
[[nodiscard]] int overlay_rings(const Body& body);

}  // namespace palpate
