// Whether the fields of a file are those that its own description asks for.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// Reads /model_toml again and compares everything that follows from it and the stored mesh: name, analysis,
/// thickness, materials and what each element is made of, held nodes and where to, loads, scope, precision,
/// overlays and dynamics. A sentence for each field that differs, empty when none does. What selects by tags
/// of the mesh file, which are not stored, is left out. `file`: for messages.
std::vector<std::string> description_differences(const Model& model, const std::filesystem::path& file);

}  // namespace palpate
