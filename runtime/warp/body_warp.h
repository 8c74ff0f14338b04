// What warping needs of a loaded body.
#pragma once

#include "runtime/body/body.h"
#include "statics/warp_balance.h"

namespace palpate {

/// The surface of a body all of whose stored nodes lie on it.
WarpSurface warp_surface(const Body& body);

/// Its Green's functions. `body` must live as long.
LinearResponse linear_response(const Body& body);

}  // namespace palpate
