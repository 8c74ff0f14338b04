// What must hold of a mesh before it is assembled.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "meshes/surface.h"

namespace palpate {

/// Reverses elements that are negatively oriented and returns how many (files disagree on the sign). Throws
/// Error (where = `where`) for a mesh without elements, node numbers out of range, a coordinate that is not
/// finite, an element with zero volume, and one whose map folds over at a corner or quadrature point. Where a
/// mesh is folded, neighbours are on the same side of a facet then: extract_surface refuses that.
std::size_t orient_elements(Mesh& mesh, const std::string& where);

/// Removes nodes that no element uses, and tagged facets with such nodes, renumbering the rest in order;
/// returns how many nodes there were.
std::size_t remove_unused_nodes(Mesh& mesh);

/// Throws Error when the elements are not one connected part (through shared sides): says how many parts,
/// their sizes and a point in each.
void check_connected(const Mesh& mesh, const std::string& where);

/// Throws Error when no node is held, or the held dofs leave a rigid motion of the body (3 in the plane, 6 in
/// space): names the motion that is left. Also when every dof is held. The motions are the null space of the
/// matrix that maps the rigid motions (scaled by the body's size) to the held dofs, up to 1e-9 of its norm.
/// `fixed` [N]: bit `axis` is set where the node is held along it.
void check_held(const Mesh& mesh, const std::vector<std::uint8_t>& fixed, const std::string& where);

/// A warning when the body is larger than 10 m or smaller than 1 mm (probably a missing unit scale), with its
/// length in metres and the geometry.scale to try; else empty. `scale`: metres per unit of the file, already
/// applied.
std::string scale_warning(const Mesh& mesh, double scale);

}  // namespace palpate
