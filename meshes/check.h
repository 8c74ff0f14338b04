// Checks and repairs of a mesh before assembly.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "meshes/surface.h"

namespace palpate {

/// Reverses negatively oriented elements and returns how many (files disagree on the sign). Throws Error
/// (where = `where`) for a mesh without elements, node numbers out of range, a coordinate that is not finite,
/// an element of zero volume, and one whose map folds over at a corner or quadrature point. If the mesh as a
/// whole is folded, neighbours end up on the same side of a facet, which extract_surface refuses.
std::size_t orient_elements(Mesh& mesh, const std::string& where);

/// Removes nodes that no element uses, and tagged facets with such nodes, and renumbers the rest in order;
/// returns the number of nodes removed.
std::size_t remove_unused_nodes(Mesh& mesh);

/// Throws Error unless the elements are one part connected through shared sides; the message gives the number
/// of parts, their sizes and a point in each.
void check_connected(const Mesh& mesh, const std::string& where);

/// Throws Error if no node is held, if every dof is, or if the held dofs leave a rigid motion of the body (3
/// in the plane, 6 in space), which the message names. Those motions are the null space of the matrix that
/// maps rigid motions (scaled by the body's size) to the held dofs, up to 1e-9 of its norm. `fixed` [N]: bit
/// `axis` is set if the node is held along that axis.
void check_held(const Mesh& mesh, const std::vector<std::uint8_t>& fixed, const std::string& where);

/// Warning if the body is larger than 10 m or smaller than 1 mm (probably a missing unit scale), with its
/// length in metres and the geometry.scale to try; else empty. `scale`: metres per unit of the file, already
/// applied.
std::string scale_warning(const Mesh& mesh, double scale);

}  // namespace palpate
