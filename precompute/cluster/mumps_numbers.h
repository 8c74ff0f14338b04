// A factor over the ranks of MPI, by MUMPS.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <memory>
#include <span>

#include "precompute/numerics/assembly.h"
#include "precompute/numerics/spread_numbers.h"

namespace palpate {

/// How MUMPS is used.
struct MumpsOptions {
  int threads = 1;  ///< of a rank, in products of matrices
  int room = 30;  ///< work space beyond what MUMPS estimates [percent]; more is tried where it is too little
};

/// Whether this build has MUMPS.
[[nodiscard]] bool has_mumps();

/// The numbers of a factor of K (lower triangle) over all ranks of `ranks`, eliminated in the order
/// `permutation` [n]: dof at each position. Analyses; all ranks have all of K, which is kept by reference.
/// Throws Error where this build has no MUMPS, or finds another one than it was built for.
[[nodiscard]] std::unique_ptr<SpreadNumbers> make_mumps_numbers(MPI_Comm ranks, const SparseMatrix& K,
                                                                std::span<const std::int64_t> permutation,
                                                                const MumpsOptions& options);

}  // namespace palpate
