// Preparation of a model for warping.
#pragma once

#include "formats/model.h"

namespace palpate {

/// Returns the model with the stored nodes of its surface alone, quasi-static; its warp is computed beside
/// the tick every few milliseconds. Probes, overlays and dynamics are dropped. Throws Error if there are no
/// Green's functions, or they are compressed and include nodes below the surface.
Model warped_model(Model model);

}  // namespace palpate
