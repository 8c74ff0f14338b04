// Recorded frames for ParaView.
#pragma once

#include <filesystem>
#include <string>

#include "formats/outputs/output_paths.h"
#include "formats/recording.h"

namespace palpate {

/// "touch.h5" becomes "touch.xdmf".
std::filesystem::path xdmf_path(const std::filesystem::path& recording);

/// A recording and what is written beside it, as outputs of a run: returns where to record. Throws Error.
std::filesystem::path add_recording(OutputPaths& paths, const std::filesystem::path& recording,
                                    const std::string& option);

/// Writes a description of the frames of a recording beside it: a time series of the surface as it is seen,
/// with its displacement, von Mises stress and contact pressure, by ParaView's XDMF Reader (that of XDMF 2).
/// Where there are no frames, removes one that is there. Throws Error.
void write_xdmf(const std::filesystem::path& recording, const RecordedFrames& frames);

}  // namespace palpate
