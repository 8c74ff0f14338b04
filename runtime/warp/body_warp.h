// Data of a loaded body for warping.
#pragma once

#include "runtime/body/body.h"
#include "statics/warp_balance.h"

namespace palpate {

/// Returns the surface of a body all of whose stored nodes lie on it.
WarpSurface warp_surface(const Body& body);

/// Returns its Green's functions. `body` must outlive the result.
LinearResponse linear_response(const Body& body);

}  // namespace palpate
