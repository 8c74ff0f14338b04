// Limits on address space (ulimit -v), with which OpenBLAS does not cope.
#pragma once

namespace palpate {

/// Throws Error where OMP_STACKSIZE is so small that OpenMP's threads do not start, which would end the
/// program.
void check_stack_size();

/// Threads that can call OpenBLAS at a time: as many as `wanted` where address space is not limited, else 1
/// or more.
int threads_with_room(int wanted);

/// Takes what OpenBLAS needs for so many threads, where address space is limited: later it would wait for
/// ever. Throws Error where that is too much.
void take_blas_room(int threads);

}  // namespace palpate
