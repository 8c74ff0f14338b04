// Labelled images in NRRD (.nrrd), as 3D Slicer saves segmentations.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/file_io.h"
#include "precompute/images/image_labels.h"

namespace palpate {

/// Whether the name ends so.
bool is_nrrd(const std::filesystem::path& file);

/// Bytes that the reader will hold; nothing where the file has no NRRD header. Throws Error with the field's
/// name where it has sizes below 1 or comes to more than check_voxels allows, where the voxels are in another
/// file, where there are fewer bytes than it asks for, and where all voxels are 0.
std::optional<std::int64_t> check_nrrd_header(const FileDescriptor& file);

/// Reads an image that check_nrrd_header has taken, by teem, for a child process. Axes are exchanged and
/// turned round as those of NIfTI; lengths are millimetres unless `space units` says otherwise.
ChildResult read_nrrd_labels(const FileDescriptor& file, const std::optional<ValueRange>& range);

}  // namespace palpate
