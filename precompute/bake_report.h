// What bakes did, as JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "precompute/bake.h"

namespace palpate {

/// How a run as a whole was done.
struct RunFigures {
  int ranks = 1;
  int jobs = 1;                             ///< threads of a rank
  double seconds = 0.0;                     ///< of wall time
  std::vector<std::int64_t> peak_memory{};  ///< of each rank [byte]
};

/// "done", "part", "planned" or "interrupted".
[[nodiscard]] std::string name_of(BakeResult result);

/// A bake's entry of a report, JSON in one line.
[[nodiscard]] std::string json_text_of(const BakeSummary& bake);

/// Writes the report, with entries of bakes, to a file, a pipe, or with "-" to standard output. Throws Error.
void write_report(const std::filesystem::path& file, const std::vector<std::string>& bakes,
                  const RunFigures& run);

/// Most memory that this process has had [byte].
[[nodiscard]] std::int64_t peak_memory();

}  // namespace palpate
