// XDMF description of the pictures in an HDF5 file, for ParaView.
#pragma once

#include <filesystem>
#include <span>

#include "formats/recording.h"

namespace palpate {

/// Path of the description: "touch.h5" becomes "touch.xdmf".
std::filesystem::path xdmf_path(const std::filesystem::path& hdf5);

/// Writes a description of the pictures that `write_hdf5` put into `hdf5`, beside that file: a time series of
/// the visible surface with displacement, von Mises stress and contact pressure, for ParaView's XDMF Reader
/// (version 2). `times`: times of the pictures [s]. Throws Error.
void write_xdmf(const std::filesystem::path& hdf5, const RecordedSurface& surface,
                std::span<const double> times);

}  // namespace palpate
