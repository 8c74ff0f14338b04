// Pictures in an HDF5 file, for ParaView.
#pragma once

#include <filesystem>
#include <span>

#include "formats/recording.h"

namespace palpate {

/// "touch.h5" becomes "touch.xdmf".
std::filesystem::path xdmf_path(const std::filesystem::path& hdf5);

/// Writes a description of the pictures that `write_hdf5` put into `hdf5` beside it: a time series of the
/// surface as it is seen, with its displacement, von Mises stress and contact pressure, by ParaView's XDMF
/// Reader (that of XDMF 2). `times`: of the pictures [s]. Throws Error.
void write_xdmf(const std::filesystem::path& hdf5, const RecordedSurface& surface,
                std::span<const double> times);

}  // namespace palpate
