// Labelled images in NRRD (.nrrd), as 3D Slicer saves segmentations.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "precompute/images/image_labels.h"

namespace palpate {

/// Whether the name ends so.
bool is_nrrd(const std::filesystem::path& file);

/// Bytes that the reader will hold. Throws Error with the field's name where the header has sizes below 1 or
/// comes to more than most_voxels, where the voxels are in another file, and where there are fewer bytes than
/// it asks for; where it is no NRRD header the file is left to its reader.
std::int64_t check_nrrd_header(const std::filesystem::path& file);

/// Reads the image by teem, for a child process. Axes are exchanged and turned round as those of NIfTI;
/// lengths are millimetres unless `space units` says otherwise.
ChildResult read_nrrd_labels(const std::string& file);

}  // namespace palpate
