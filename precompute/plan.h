// Estimated requirements of a precomputation.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "formats/journal.h"
#include "matrices/packed.h"
#include "precompute/numerics/greens_solver.h"

namespace palpate {

/// Requirements known after meshing and symbolic analysis.
struct Plan {
  std::int64_t nodes = 0, elements = 0;
  std::int64_t free_dofs = 0;        ///< order of K
  std::int64_t stored_dofs = 0;      ///< order n of the stored block of Xi
  std::int64_t factor_entries = 0;   ///< stored entries of L
  std::int64_t file_bytes = 0;       ///< of the packed matrix, the bulk of the file
  std::int64_t factor_bytes = 0;     ///< [byte] of memory; if distributed, this process's part
  std::int64_t resident_bytes = 0;   ///< [byte] of memory that the process has when the plan is made: mesh
                                     ///< and K
  std::int64_t workspace_bytes = 0;  ///< of memory, of all jobs while they solve, beside the factor
  std::int64_t overlay_bytes = 0;    ///< of memory, for overlays until they are written
  std::int64_t dynamics_bytes = 0;   ///< of memory, for mass, damping, K_bar and modes
  std::int64_t block_columns = 0;    ///< most right-hand sides solved at a time
  bool for_many = false;             ///< blocks are sized for many threads
  double flops = 0.0;                ///< of the column solves
  double seconds = 0.0;              ///< estimate of the column solves with all jobs, from a measured rate
  double factor_seconds = 0.0;       ///< of the factorisation, by one thread
  double precision_seconds = 0.0;    ///< of the touches for choosing the precision
  double write_seconds = 0.0;        ///< of checksums and probes after the columns
};

/// Columns that are solved together, in the order in which they are begun; they depend on the model alone.
std::vector<PieceRange> column_blocks(const Plan& plan);

Plan make_plan(const Mesh& mesh, const Factor& factor, const GreensSolver& solver,
               std::optional<Precision> precision, int jobs);

/// Estimated time for overlays of so many bytes, condensed by `jobs` threads [s].
double overlay_seconds(std::int64_t bytes, int jobs);

/// Time of Lanczos' method for so many modes [s].
double modes_seconds(const Plan& plan, std::int64_t modes);

/// Expected peak memory of the process [byte]: its memory when the plan is made, the factor, and the larger
/// of workspaces and data written before these are allocated.
std::int64_t expected_memory(const Plan& plan);

/// Memory of so many threads besides their workspaces: stacks, and buffers of OpenBLAS [byte].
std::int64_t thread_bytes(std::int64_t threads);

/// Memory that the process has now [byte]; 0 if the kernel does not say.
std::int64_t resident_memory();

/// Throws Error with the numbers if the plan needs more than the free memory, besides the memory that the
/// process has already, for so many ranks on this machine.
void check_memory(const Plan& plan, int ranks = 1);

}  // namespace palpate
