// A recording as HDF5, for h5py, MATLAB and ParaView.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "formats/recording.h"

namespace palpate {

/// Rows [begin, end) of the ticks.
struct TickRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// Writes attributes, /ticks, /surface and /frames as docs/reference/recording-fields.md has them.
/// `pictures`: those that are written, ascending; `frame` gives each, one after the other. Takes memory for
/// some thousand ticks and one picture. Throws Error; then what stood at `file` is as it was.
void write_hdf5(const std::filesystem::path& file, const RecordingFile& recording, TickRange ticks,
                std::span<const std::int64_t> pictures,
                const std::function<SurfaceFrame(std::int64_t)>& frame);

}  // namespace palpate
