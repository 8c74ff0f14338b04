// How far overlays of a body may reach.
#pragma once

#include "runtime/body/body.h"

namespace palpate {

/// The most rings that any overlay of the body may have: the file keeps as many layers below its surface.
/// From 0 (none at all) to `most_rings`.
[[nodiscard]] int overlay_rings(const Body& body);

}  // namespace palpate
