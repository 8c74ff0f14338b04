// Labelled images in INR (.inr, .inr.gz).
#pragma once

#include <cstdint>
#include <optional>

#include "base/file_io.h"
#include "precompute/images/image_labels.h"

namespace palpate {

/// Bytes that the reader of an image will hold: the file's, or those of a gzipped one unpacked; nothing where
/// the file has no INR header. Throws Error with the field's name when the dimensions are below 1, come to
/// more than check_voxels allows, or ask for more bytes than the file holds, and where all voxels are 0.
std::optional<std::int64_t> check_inr_header(const FileDescriptor& file);

/// Reads an image that check_inr_header has taken. Whole numbers of 8 to 64 bits, and floats and doubles.
ChildResult read_inr_labels(const FileDescriptor& file, const std::optional<ValueRange>& range);

}  // namespace palpate
