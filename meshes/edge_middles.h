// Middle nodes of edges.
#pragma once

#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Middle nodes, not listed themselves, of edges both of whose ends are listed; ascending. Files that know
/// corners alone have no numbers for them. Numbers out of range are ignored.
std::vector<Index> middles_between(const Mesh& mesh, const std::vector<Index>& listed);

}  // namespace palpate
