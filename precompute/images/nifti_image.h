// Labelled images in NIfTI, versions 1 and 2 (.nii, .nii.gz).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/file_io.h"
#include "precompute/images/image_labels.h"

namespace palpate {

/// True if the name has a NIfTI ending.
bool is_nifti(const std::filesystem::path& file);

/// Size of the data that the reader will hold [byte]; nullopt if the file has no NIfTI header, plain or
/// gzipped, of a single file with its voxels. Throws Error with the field's name if dimensions are below 1,
/// exceed the limit of check_voxels, or need more bytes than the file has, and if all voxels are 0.
std::optional<std::int64_t> check_nifti_header(const FileDescriptor& file);

/// Reads an image accepted by check_nifti_header; libnifti interprets the header. Axes are permuted and
/// reversed so that x points to the patient's right, y to the front and z to the head, as nearly as possible;
/// lengths are millimetres.
ChildResult read_nifti_labels(const FileDescriptor& file, const std::optional<ValueRange>& range);

}  // namespace palpate
