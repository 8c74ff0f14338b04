// A recording as HDF5, for h5py, MATLAB and ParaView.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "formats/hdf5.h"
#include "formats/recording.h"

namespace palpate {

/// A field of a tick as a dataset: /ticks/NAME, with a row of `components` numbers for each tick.
struct TickColumn {
  std::string name;
  hdf5::ElementType type;
  std::int64_t components = 1;
  std::size_t offset = 0;  ///< of the numbers in TickRecord

  [[nodiscard]] std::size_t bytes() const { return type.bytes * static_cast<std::size_t>(components); }
};

/// All fields, in the order of the message.
[[nodiscard]] std::vector<TickColumn> tick_columns();

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
