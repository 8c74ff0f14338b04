// A factor distributed over the ranks of MPI by MUMPS.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <memory>
#include <span>

#include "precompute/numerics/assembly.h"
#include "precompute/numerics/spread_numbers.h"

namespace palpate {

/// Options for MUMPS.
struct MumpsOptions {
  int threads = 1;  ///< per rank, in products of matrices
  int room = 30;    ///< work space beyond MUMPS's estimate [percent]; more is tried if it is too little
};

/// True if this build has MUMPS.
[[nodiscard]] bool has_mumps();

/// Numbers of a factor of K (lower triangle) over all ranks of `ranks`, with the elimination order
/// `permutation` [n]: the dof at each position. Analyses; all ranks have all of K, to which it keeps a
/// reference. Throws Error if this build has no MUMPS, or loads another version than it was built for.
[[nodiscard]] std::unique_ptr<SpreadNumbers> make_mumps_numbers(MPI_Comm ranks, const SparseMatrix& K,
                                                                std::span<const std::int64_t> permutation,
                                                                const MumpsOptions& options);

}  // namespace palpate
