// Baking: from a description to NAME.palpate.hdf.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "precompute/description/description.h"
#include "precompute/plan.h"
#include "precompute/team.h"
#include "precompute/time_left.h"

namespace palpate {

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
  std::filesystem::path report{};              ///< report of the run, which an output must not replace;
                                               ///< empty: none
};

/// Outcome of a bake.
enum class BakeResult : std::uint8_t { done, part_done, planned, interrupted };

/// Runs the whole precomputation: mesh, K, factor, columns, file. Prints progress to standard error. On
/// Ctrl-C, SIGTERM or SIGUSR1 it stops after the current block of columns; the next run of the same model
/// continues from the finished columns. Throws Error for bad input, and with the numbers if memory or disk
/// space is insufficient.
BakeResult bake(const Description& description, const BakeOptions& options);

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

/// Runs the precomputation together with other processes, which call this too. They divide columns,
/// compression and overlays among them; each computes everything else before the columns; only the leader
/// prints and writes the rest.
BakeSummary bake(const Description& description, const BakeOptions& options, Team& team);

}  // namespace palpate
