// The surface that a tool meets: a numbering of its own nodes, and the elements under it.
#pragma once

#include <span>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// The nodes on a surface, numbered from 0.
struct SurfaceNumbering {
  std::vector<Index> mesh_nodes;  ///< [S] mesh node of each, ascending
  std::vector<Index> simplices;   ///< [F * d] the surface's simplices in this numbering, order kept
};

/// Numbers the nodes of `simplices` [F * d], which are nodes of a mesh of `mesh_nodes`.
SurfaceNumbering number_surface(std::span<const Index> simplices, std::size_t mesh_nodes);

/// The element that each simplex of model.surface is a side, or a part of a side, of. [F] Throws Error (where
/// = the model's name) for a simplex that is none.
std::vector<Index> surface_elements(const Model& model);

}  // namespace palpate
