// What the system, or a batch system, lets this process use of the machine.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

/// Processors that this process may use: those of its affinity mask, no more than the quota of its control
/// groups (rounded up) and than SLURM_CPUS_PER_TASK, where there are such; at least 1. `root` is put before
/// /proc and /sys.
int allotted_processors(const std::string& root = "");

/// Memory that can be had without swapping and within the limits of the process's control groups, whose page
/// cache counts as free, and no more than SLURM_MEM_PER_NODE, or SLURM_MEM_PER_CPU of all SLURM_CPUS_ON_NODE,
/// and than RLIMIT_AS (ulimit -v) leaves [byte]; 0 when the system does not say.
std::int64_t allotted_memory(const std::string& root = "");
}  // namespace palpate
