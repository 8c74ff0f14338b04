// Model of a live body in the form that the tick uses.
#pragma once

#include "formats/model.h"
#include "runtime/live/live_settings.h"
#include "runtime/live/live_stepper.h"
#include "statics/live_body.h"

namespace palpate {

/// Live body, which is solved during the touch, with the options of its steps.
struct LiveParts {
  LiveBody body;
  StepperOptions stepper;
};

/// Makes the live body of a model. With `free` it has no supports, and a given Poisson's ratio replaces that
/// of its materials. Throws Error if the settings do not fit the model, or explicit steps are unstable.
LiveParts make_live_parts(const Model& model, const LiveSettings& settings);

/// Returns the model with the tick's data of a live body instead of its Green's functions, overlays and
/// dynamics. Stored nodes are all movable surface nodes; in the plane, with up to 3000 dofs, all nodes, so
/// that the interior is visible. The rest position is that of balance, or of the mesh if it is not found.
/// `greens` is the compliance of one step there: the displacement of its end per force during it (for
/// implicit Euler (M / h^2 + C_d / h + K)^-1). The dynamics are those of steps beside the tick.
Model live_model(Model model, const LiveParts& live, const LiveSettings& settings);

}  // namespace palpate
