// Comparison of a file's fields with its own description.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// Reads /model_toml again and compares everything that follows from it and the stored mesh: name, analysis,
/// thickness, materials and the material of each element, held nodes and their displacements, loads, scope,
/// precision, overlays and dynamics. One sentence per field that differs, empty if none does. Selections by
/// tags of the mesh file, which are not stored, are left out. `file`: for messages.
std::vector<std::string> description_differences(const Model& model, const std::filesystem::path& file);

}  // namespace palpate
