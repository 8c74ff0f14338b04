// Preparation of a model for two levels.
#pragma once

#include "formats/model.h"

namespace palpate {

/// Returns the model as a body on two levels has it: quasi-static, its balance found beside the tick every
/// few milliseconds, longer for large meshes. Overlays and dynamics are dropped. Throws Error if there are no
/// Green's functions.
Model deep_model(Model model);

}  // namespace palpate
