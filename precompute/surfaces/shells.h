// Shells: the disconnected parts of a surface. One encloses the body, others its cavities.
#pragma once

#include <functional>
#include <vector>

#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// Smallest volume / area^1.5 of a surface that encloses a body: a ball has 0.094, a pipe with a wall of 1 :
/// 400 has 7e-4.
inline constexpr double least_filling = 1e-5;

/// Parts of a surface that have no node in common, in the order of their first triangles.
std::vector<TriangleSurface> shells_of(const TriangleSurface& surface);

/// Shells as one surface, in their order.
TriangleSurface together(const std::vector<TriangleSurface>& shells);

/// Orients a closed shell outwards, or inwards as that of a cavity. Returns true if that changed it.
bool turn(TriangleSurface& shell, bool outwards);

/// Shells of a surface, if it has several, that are oriented inwards: their inside is empty.
std::vector<TriangleSurface> cavities_of(const TriangleSurface& surface);

/// A point inside a closed shell.
Vec3 point_inside(const TriangleSurface& shell);

/// The shells of a body, and shells that do not belong to it.
struct BodyShells {
  std::vector<TriangleSurface> kept;    ///< first the outer shell, then those of cavities
  std::vector<TriangleSurface> others;  ///< beside the body, inside a cavity, or open or flat inside the body
  bool turned = false;                  ///< the outer shell was inside out
};

/// Finds the outer shell (the one with the largest area, or the largest closed one around it), repairs it by
/// `mend`, and finds its cavities: the closed shells in it that are not inside another of them. Orients
/// closed shells correctly.
BodyShells body_shells(
    std::vector<TriangleSurface> shells, const std::function<TriangleSurface(TriangleSurface)>& mend =
                                             [](const TriangleSurface& shell) { return shell; });

}  // namespace palpate
