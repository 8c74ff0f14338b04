// Request, common input of the stages, and result of a bake.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "precompute/description/description.h"
#include "precompute/plan.h"
#include "precompute/progress.h"
#include "precompute/team.h"

namespace palpate {

class InterruptGuard;

/// Part `number` of `parts` of a bake, counted from 1.
struct PartNumber {
  std::int64_t number = 1;
  std::int64_t parts = 1;
};

/// Condition for distributing the numbers of a factor over the processes.
enum class Spreading : std::uint8_t { never, where_needed, always };

/// Options of a bake besides the description.
struct BakeOptions {
  std::filesystem::path output;      ///< file to write
  int jobs = 1;                      ///< threads
  bool dry_run = false;              ///< stop after the plan is printed
  bool discard = false;              ///< start again even if an interrupted run can be continued
  bool force = false;                ///< the output may replace any file that the run does not read
  bool keep = false;                 ///< it may replace no file
  std::optional<PartNumber> part{};  ///< solve for these columns alone, into a file beside the output
  bool join = false;                 ///< take the columns from parts
  std::vector<std::filesystem::path> parts{};  ///< parts or folders of parts; none: parts beside the output
  bool keep_parts = false;                     ///< do not remove the parts
  Spreading spreading = Spreading::never;      ///< where_needed: if a process cannot hold a factor
  int ranks = 0;                               ///< number that the plan is for; 0: that of the team
  std::filesystem::path report{};  ///< report of the run, which an output must not replace; empty: none
};

/// Outcome of a bake.
enum class BakeResult : std::uint8_t { done, part_done, planned, interrupted };

/// Summary of a bake.
struct BakeSummary {
  std::string model;  ///< file of the description
  std::filesystem::path output;
  std::optional<PartNumber> part{};
  BakeResult result = BakeResult::planned;
  int jobs = 1;
  Plan plan{};
  std::int64_t foretold = 0;             ///< planned memory, also that of a compression that was given up
  TileCounts tiles{};                    ///< over all processes
  std::optional<SpreadMemory> spread{};  ///< for a factor over several processes
  std::vector<Stage> stages{};           ///< with the measured seconds
  bool compressed = false;
  std::string fell_back{};  ///< why compression = "auto" stored every entry; empty: it did not
};

/// Common input of all stages.
struct BakeRun {
  const Description& description;
  const BakeOptions& options;
  Team& team;
  int jobs;  ///< threads of this process
  Progress& progress;
  InterruptGuard& interrupt;
  std::function<bool()> interrupted;
  BakeSummary& summary;
};

}  // namespace palpate
