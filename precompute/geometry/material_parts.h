// Which material each element is made of.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate {

/// Number in `parts` of the material of each element. [E] Throws Error (where = `file` and the entry) where
/// two parts claim an element, an element is left without material, or a part has no element.
std::vector<Index> materials_of_elements(const Mesh& mesh, const std::vector<MaterialPart>& parts,
                                         const std::string& file);

}  // namespace palpate
