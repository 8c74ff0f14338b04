#include "base/error.h"
#include "precompute/cluster/mumps_numbers.h"

namespace palpate {

bool has_mumps() {
  return false;
}

std::unique_ptr<SpreadNumbers> make_mumps_numbers(MPI_Comm /*ranks*/, const SparseMatrix& /*K*/,
                                                  std::span<const std::int64_t> /*permutation*/,
                                                  const MumpsOptions& /*options*/) {
  throw Error("this build of palpate-precompute-mpi has no MUMPS, which spreads a factor over ranks",
              "--factor distributed", "Install libmumps-dev and build again, or use --factor node");
}

}  // namespace palpate
