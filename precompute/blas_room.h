// Limits on address space (ulimit -v), with which OpenBLAS does not cope.
#pragma once

namespace palpate {

/// To be called first. OpenBLAS maps 128 MiB for each thread that calls it and for each of its own, and where
/// address space is limited it waits for ever for what it does not get. There the program is started anew
/// without threads of OpenBLAS and OpenMP. Throws Error where OMP_STACKSIZE is so small that OpenMP's threads
/// do not start, which would end the program.
void prepare_threads(char** arguments);

/// Threads that can call OpenBLAS at a time: as many as `wanted` where address space is not limited, else 1
/// or more.
int threads_with_room(int wanted);

/// Takes what OpenBLAS needs for so many threads, where address space is limited: later it would wait for
/// ever. Throws Error where that is too much.
void take_blas_room(int threads);

}  // namespace palpate
