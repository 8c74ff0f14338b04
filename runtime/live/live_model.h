// A file's model as a live solver moves it, for the tick.
#pragma once

#include "formats/model.h"
#include "runtime/live/live_settings.h"
#include "runtime/live/live_stepper.h"
#include "statics/live_body.h"

namespace palpate {

/// A body that is solved while it is touched, and what its steps are.
struct LiveParts {
  LiveBody body;
  StepperOptions stepper;
};

/// The body of a model; with `free` nothing of it is held, and with a Poisson's ratio its materials have
/// that. Throws Error for settings that do not fit it, and for explicit steps longer than is stable.
LiveParts make_live_parts(const Model& model, const LiveSettings& settings);

/// The model with what the tick needs of a live body in place of its Green's functions, overlays and
/// dynamics: stored are all nodes of the surface that can move, of a body in the plane with up to 3000 dofs
/// all nodes, so that its inside is seen; it rests where its forces balance, or as its mesh is where they do
/// not; `greens` is the compliance of one step there, by how much its end moves with the forces in it (of
/// implicit Euler (M / h^2 + C_d / h + K)^-1); dynamics are those of steps beside the tick.
Model live_model(Model model, const LiveParts& live, const LiveSettings& settings);

}  // namespace palpate
