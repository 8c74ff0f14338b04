// The index of models that lost it or were changed by another program.
#pragma once

#include <filesystem>

namespace palpate {

/// Rewrites the file with a new index in front of its HDF5 part. Throws Error if it is no model of this
/// format version; the file is then unchanged.
void add_index(const std::filesystem::path& model);

/// True if a file's index matches its HDF5 part. Throws Error if one of them cannot be read.
[[nodiscard]] bool is_index_right(const std::filesystem::path& model);

}  // namespace palpate
