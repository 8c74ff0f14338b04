// Labelled images in INR (.inr, .inr.gz).
#pragma once

#include <cstdint>
#include <optional>

#include "base/file_io.h"
#include "precompute/images/image_labels.h"

namespace palpate {

/// Size of the data that the reader of an image will hold [byte]: the file, or the unpacked file if gzipped;
/// nullopt if the file has no INR header. Throws Error with the field's name if dimensions are below 1,
/// exceed the limit of check_voxels, or need more bytes than the file has, and if all voxels are 0.
std::optional<std::int64_t> check_inr_header(const FileDescriptor& file);

/// Reads an image accepted by check_inr_header. Whole numbers of 8 to 64 bits, and floats and doubles.
ChildResult read_inr_labels(const FileDescriptor& file, const std::optional<ValueRange>& range);

}  // namespace palpate
