// Parts of a bake: where they lie, and whether all are there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace palpate {

/// PATH.part-3-of-16, beside the model PATH.
std::filesystem::path part_path(const std::filesystem::path& model, std::int64_t number, std::int64_t parts);

/// The parts of a model, by their number: those in `named`, files and folders, or where it is empty those
/// beside the model. Throws Error where there are none, one is missing, twice there or not finished, or not
/// all are of one bake. Only reads journals.
std::vector<std::filesystem::path> find_parts(const std::filesystem::path& model,
                                              const std::vector<std::filesystem::path>& named);

/// Removes parts and their journals.
void remove_parts(const std::vector<std::filesystem::path>& parts) noexcept;

}  // namespace palpate
