// Middles of edges as nodes.
#pragma once

#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Middles of edges that are not listed though both ends are, ascending: a file that has corners alone has no
/// numbers for them. Numbers out of range count for nothing.
std::vector<Index> middles_between(const Mesh& mesh, const std::vector<Index>& listed);

}  // namespace palpate
