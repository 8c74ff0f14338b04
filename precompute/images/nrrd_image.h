// Labelled images in NRRD (.nrrd), as 3D Slicer saves segmentations.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/file_io.h"
#include "precompute/images/image_labels.h"

namespace palpate {

/// True if the name has a NRRD ending.
bool is_nrrd(const std::filesystem::path& file);

/// Size of the data that the reader will hold [byte]; nullopt if the file has no NRRD header. Throws Error
/// with the field's name if sizes are below 1 or exceed the limit of check_voxels, if the voxels are in
/// another file, if there are fewer bytes than required, and if all voxels are 0.
std::optional<std::int64_t> check_nrrd_header(const FileDescriptor& file);

/// Reads an image accepted by check_nrrd_header, by teem, for a child process. Axes are permuted and reversed
/// as those of NIfTI; lengths are millimetres unless `space units` says otherwise.
ChildResult read_nrrd_labels(const FileDescriptor& file, const std::optional<ValueRange>& range);

}  // namespace palpate
