// Reports of bakes as JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "precompute/bake.h"

namespace palpate {

/// Figures of a run as a whole.
struct RunFigures {
  int ranks = 1;
  int jobs = 1;                             ///< threads per rank
  double seconds = 0.0;                     ///< wall time [s]
  std::vector<std::int64_t> peak_memory{};  ///< of each rank [byte]
};

/// Name of a result: "done", "part", "planned" or "interrupted".
[[nodiscard]] std::string name_of(BakeResult result);

/// Entry of a bake in a report, JSON on one line.
[[nodiscard]] std::string json_text_of(const BakeSummary& bake);

/// Writes a report with the entries of bakes to a file, a pipe, or for "-" to standard output. Throws Error.
void write_report(const std::filesystem::path& file, const std::vector<std::string>& bakes,
                  const RunFigures& run);

/// Peak memory of this process [byte].
[[nodiscard]] std::int64_t peak_memory();

}  // namespace palpate
