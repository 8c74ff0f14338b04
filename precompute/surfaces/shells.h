// Shells: the parts of a surface that are apart. One is around the body, others around its cavities.
#pragma once

#include <functional>
#include <vector>

#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// Volume / area^1.5 that something encloses at least: 0.094 of a ball, 7e-4 of a pipe's wall of 1 : 400.
inline constexpr double least_filling = 1e-5;

/// The parts of a surface that share no node, in the order of their first triangles.
std::vector<TriangleSurface> shells_of(const TriangleSurface& surface);

/// Shells as one surface, in their order.
TriangleSurface together(const std::vector<TriangleSurface>& shells);

/// Turns a closed shell outwards, or inwards as that of a cavity. Returns whether it was not so.
bool turn(TriangleSurface& shell, bool outwards);

/// Those shells of a surface of several that are turned inwards: what they enclose is empty.
std::vector<TriangleSurface> cavities_of(const TriangleSurface& surface);

/// A point in a closed shell.
Vec3 point_inside(const TriangleSurface& shell);

/// A surface as a body and what does not belong to it.
struct BodyShells {
  std::vector<TriangleSurface> kept;  ///< first the outer shell, then those of cavities
  std::vector<TriangleSurface>
      others;           ///< beside the body, inside of a cavity, or open or flat inside the body
  bool turned = false;  ///< the outer shell was inside out
};

/// Finds the outer shell, that with the largest area or the largest closed one around it, mends it by `mend`,
/// and finds its cavities: the closed shells in it that are not in another of them. Turns closed ones as they
/// have to be.
BodyShells body_shells(
    std::vector<TriangleSurface> shells, const std::function<TriangleSurface(TriangleSurface)>& mend =
                                             [](TriangleSurface shell) { return shell; });

}  // namespace palpate
