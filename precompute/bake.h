// From a description to NAME.palpate.hdf.
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

/// Number `number` of `parts` of a bake, from 1.
struct PartNumber {
  std::int64_t number = 1;
  std::int64_t parts = 1;
};

/// Whether the numbers of a factor are spread over the processes.
enum class Spreading : std::uint8_t { never, where_needed, always };

/// What is asked of a bake besides the description.
struct BakeOptions {
  std::filesystem::path output;      ///< file to write
  int jobs = 1;                      ///< threads
  bool dry_run = false;              ///< stop after the plan is printed
  bool discard = false;              ///< begin anew where an earlier run was interrupted
  bool force = false;                ///< the output may take the place of any file that is not read
  bool keep = false;                 ///< it may take that of none
  std::optional<PartNumber> part{};  ///< solve for these columns alone, into a file beside the output
  bool join = false;                 ///< take the columns from parts
  std::vector<std::filesystem::path> parts{};  ///< those, or their folders; none: those beside the output
  bool keep_parts = false;                     ///< leave them there
  Spreading spreading = Spreading::never;      ///< where needed: where one cannot hold a factor
  int ranks = 0;                               ///< that the plan is for; 0: as many as the team has
  std::filesystem::path report{};              ///< of the run, which is not to be lost; empty: none
};

/// How a bake ended.
enum class BakeResult : std::uint8_t { done, part_done, planned, interrupted };

/// Runs the whole precomputation: mesh, K, factor, columns, file. Prints progress to standard error. On
/// Ctrl-C, SIGTERM or SIGUSR1 it stops at the next block of columns and keeps those that are done, from which
/// the next run of the same model goes on. Throws Error for bad input, and with the numbers when memory or
/// disk will not do.
BakeResult bake(const Description& description, const BakeOptions& options);

/// How a bake went.
struct BakeSummary {
  std::string model;  ///< the description's file
  std::filesystem::path output;
  std::optional<PartNumber> part{};
  BakeResult result = BakeResult::planned;
  int jobs = 1;
  Plan plan{};
  std::int64_t foretold = 0;             ///< memory of it, and of a compression that was given up
  TileCounts tiles{};                    ///< of all processes
  std::optional<SpreadMemory> spread{};  ///< of a factor over several processes
  std::vector<Stage> stages{};           ///< with the seconds that they took
  bool compressed = false;
  std::string fell_back{};  ///< why compression = "auto" ended with every entry; empty: it did not
};

/// Runs it with other processes, which call this too: they share columns, compression and overlays, each
/// computes what else comes before the columns, and the leader alone prints and writes the rest.
BakeSummary bake(const Description& description, const BakeOptions& options, Team& team);

}  // namespace palpate
