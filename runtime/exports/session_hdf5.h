// A recording as HDF5, for h5py, MATLAB and ParaView.
#pragma once

#include <cstdint>
#include <filesystem>

#include "formats/recording.h"

namespace palpate {

/// Rows [begin, end) of the ticks.
struct TickRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// Writes attributes, /ticks, /surface and the space of /frames for `pictures` pictures, as
/// docs/reference/recording-fields.md has them, into a file that is emptied. Takes memory for some thousand
/// ticks. Throws Error.
void write_hdf5(const std::filesystem::path& file, const RecordingFile& recording, TickRange ticks,
                std::int64_t pictures);

}  // namespace palpate
