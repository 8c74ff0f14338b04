// The index of models that have lost it, or that another program has changed.
#pragma once

#include <filesystem>

namespace palpate {

/// Writes the file anew, with the index in front of its HDF5 in place of what stands there. Throws Error
/// where it is no model of this format version; then it is as it was.
void add_index(const std::filesystem::path& model);

/// Whether a file's index says what its HDF5 says. Throws Error where one of them cannot be read.
[[nodiscard]] bool is_index_right(const std::filesystem::path& model);

}  // namespace palpate
