// Labelled images in NIfTI, versions 1 and 2 (.nii, .nii.gz).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "precompute/images/image_labels.h"

namespace palpate {

/// Whether the name ends so.
bool is_nifti(const std::filesystem::path& file);

/// Bytes that the reader will hold. Throws Error with the field's name where the header, plain or gzipped,
/// has dimensions below 1, comes to more than most_voxels, or asks for more bytes than the file holds; where
/// it is no NIfTI header the file is left to its reader.
std::int64_t check_nifti_header(const std::filesystem::path& file);

/// Reads the image by libnifti, for a child process. Axes are exchanged and turned round so that x points to
/// the patient's right, y to the front and z to the head, as near as they come; lengths are millimetres.
ChildResult read_nifti_labels(const std::string& file);

}  // namespace palpate
