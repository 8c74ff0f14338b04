// Export of a recording as HDF5, for h5py, MATLAB and ParaView.
#pragma once

#include <cstdint>
#include <filesystem>

#include "formats/recording.h"

namespace palpate {

/// Range [begin, end) of ticks.
struct TickRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// Writes attributes, /ticks, /surface and, for `pictures` pictures, the allocated /frames, as in
/// docs/reference/recording-fields.md. An existing file is overwritten. Needs memory for a few thousand
/// ticks. Throws Error.
void write_hdf5(const std::filesystem::path& file, const RecordingFile& recording, TickRange ticks,
                std::int64_t pictures);

}  // namespace palpate
