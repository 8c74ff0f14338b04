// Limits on address space (ulimit -v), with which OpenBLAS does not cope.
#pragma once

namespace palpate {

/// Throws Error if OMP_STACKSIZE is so small that OpenMP's threads would not start, which would end the
/// program.
void check_stack_size();

/// Number of threads that can call OpenBLAS at a time: `wanted` if address space is not limited, else as
/// many as fit, at least 1.
int threads_with_room(int wanted);

/// Reserves OpenBLAS's memory for so many threads if address space is limited; later OpenBLAS would wait for
/// it forever. Throws Error if that is too much.
void take_blas_room(int threads);

}  // namespace palpate
