// Files of the parts of a bake.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace palpate {

/// Path of a part, PATH.part-3-of-16, beside the model PATH.
std::filesystem::path part_path(const std::filesystem::path& model, std::int64_t number, std::int64_t parts);

/// Parts of a model, by number: those in `named`, files and folders, or if it is empty those beside the
/// model. Throws Error if there are none, one is missing, occurs twice or is unfinished, or if they are not
/// of one bake. Reads only journals.
std::vector<std::filesystem::path> find_parts(const std::filesystem::path& model,
                                              const std::vector<std::filesystem::path>& named);

/// Removes parts and their journals.
void remove_parts(const std::vector<std::filesystem::path>& parts) noexcept;

}  // namespace palpate
