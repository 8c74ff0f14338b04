// Header of INR images, checked before anything is allocated by it.
#pragma once

#include <cstdint>
#include <filesystem>

namespace palpate {

/// Bytes that the reader of an image will hold: the file's, or those of a gzipped one unpacked. Throws Error
/// with the field's name when the file is an INR image (plain or gzipped) whose dimensions are below 1, come
/// to more than most_voxels, or ask for more bytes than the file holds. Other files are left to their reader.
std::int64_t check_inr_header(const std::filesystem::path& file);

}  // namespace palpate
