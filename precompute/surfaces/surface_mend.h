// Single repairs of a closed surface, by CGAL; third-party code, for child processes.
#pragma once

#include <string>

#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// Reason why a surface is not closed, manifold, around one body and free of self-intersections: the rest of
/// "the surface ...". Empty if there is none.
std::string problem_of(const TriangleSurface& surface);

/// Cuts out intersecting triangles and fills the holes anew; the genus may change. The result may still
/// intersect itself.
TriangleSurface without_self_intersections(const TriangleSurface& surface);

/// Closed surface around the triangles at distance `offset`, with one around each of their cavities; gaps
/// narrower than `alpha` are bridged (Portaneri et al., Alpha wrapping with an offset, ACM Trans. Graph. 41,
/// 2022). Lengths are in the surface's unit.
TriangleSurface wrap_surface(const TriangleSurface& surface, double alpha, double offset);

}  // namespace palpate
