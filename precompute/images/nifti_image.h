// Labelled images in NIfTI, versions 1 and 2 (.nii, .nii.gz).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/file_io.h"
#include "precompute/images/image_labels.h"

namespace palpate {

/// Whether the name ends so.
bool is_nifti(const std::filesystem::path& file);

/// Bytes that the reader will hold; nothing where the file has no NIfTI header, plain or gzipped, of one file
/// that has its voxels as well. Throws Error with the field's name where it has dimensions below 1, comes to
/// more than check_voxels allows, or asks for more bytes than the file holds, and where all voxels are 0.
std::optional<std::int64_t> check_nifti_header(const FileDescriptor& file);

/// Reads an image that check_nifti_header has taken; libnifti makes sense of its header. Axes are exchanged
/// and turned round so that x points to the patient's right, y to the front and z to the head, as near as
/// they come; lengths are millimetres.
ChildResult read_nifti_labels(const FileDescriptor& file, const std::optional<ValueRange>& range);

}  // namespace palpate
