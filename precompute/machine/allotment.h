// Resources of the machine that the system, or a batch system, allots to this process.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

/// Processors that this process may use: those of its affinity mask, at most the quota of its control groups
/// (rounded up) and SLURM_CPUS_PER_TASK, if there are any; at least 1. `root` is prepended to /proc and /sys.
int allotted_processors(const std::string& root = "");

/// Memory available without swapping and within the limits of the process's control groups, whose page cache
/// counts as free; at most SLURM_MEM_PER_NODE, or SLURM_MEM_PER_CPU times SLURM_CPUS_ON_NODE, and the rest of
/// RLIMIT_AS (ulimit -v) [byte]; 0 if unknown.
std::int64_t allotted_memory(const std::string& root = "");
}  // namespace palpate
