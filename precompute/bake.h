// From a description to NAME.palpate.hdf.
#pragma once

#include <cstdint>
#include <filesystem>

#include "precompute/description/description.h"

namespace palpate {

/// What is asked of a bake besides the description.
struct BakeOptions {
  std::filesystem::path output;  ///< file to write
  int jobs = 1;                  ///< threads
  bool dry_run = false;          ///< stop after the plan is printed
  bool discard = false;          ///< begin anew where an earlier run was interrupted
  bool force = false;            ///< the output may take the place of any file that is not read
};

/// How a bake ended.
enum class BakeResult : std::uint8_t { done, planned, interrupted };

/// Runs the whole precomputation: mesh, K, factor, columns, file. Prints progress to standard error. On
/// Ctrl-C or SIGTERM it stops at the next block of columns and keeps those that are done, from which the next
/// run of the same model goes on. Throws Error for bad input, and with the numbers when memory or disk will
/// not do.
BakeResult bake(const Description& description, const BakeOptions& options);

}  // namespace palpate
