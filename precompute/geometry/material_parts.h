// Materials of elements.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate {

/// Number in `parts` of each element's material. [E] Throws Error (where = `file` and the entry) if two parts
/// claim an element, an element has no material, or a part has no element.
std::vector<Index> materials_of_elements(const Mesh& mesh, const std::vector<MaterialPart>& parts,
                                         const std::string& file);

}  // namespace palpate
