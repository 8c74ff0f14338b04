// A file's model as warping wants it.
#pragma once

#include "formats/model.h"

namespace palpate {

/// The model with the stored nodes of its surface alone, quasi-static, whose warp is found beside the tick
/// every few milliseconds. Probes, overlays and dynamics are left out. Throws Error where Green's functions
/// are compressed and hold nodes below the surface too, or there are none.
Model warped_model(Model model);

}  // namespace palpate
