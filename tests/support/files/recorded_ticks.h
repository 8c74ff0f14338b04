// All ticks of a recording at once.
#pragma once

#include <filesystem>
#include <vector>

#include "formats/recording.h"

namespace palpate::test {

inline std::vector<TickRecord> ticks_of(const std::filesystem::path& path) {
  const RecordingFile file(path);
  std::vector<TickRecord> ticks;
  for (std::int64_t row = 0; row < file.ticks(); ++row) ticks.push_back(file.tick(row));
  return ticks;
}

}  // namespace palpate::test
