// Single repairs of a closed surface, by CGAL; foreign code, for child processes.
#pragma once

#include <string>

#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// What keeps a surface from being closed, manifold, around one body and free of self-intersections: the rest
/// of "the surface ...". Empty where nothing does.
std::string problem_of(const TriangleSurface& surface);

/// Cuts out triangles that intersect and fills the holes anew; the genus may change. The result may still
/// intersect itself.
TriangleSurface without_self_intersections(const TriangleSurface& surface);

/// A closed surface around the triangles, at the distance `offset` from them, and one around each of their
/// cavities; gaps narrower than `alpha` are bridged (Portaneri et al., Alpha wrapping with an offset, ACM
/// Trans. Graph. 41, 2022). Lengths are in the surface's unit.
TriangleSurface wrap_surface(const TriangleSurface& surface, double alpha, double offset);

}  // namespace palpate
