// How OpenBLAS is started.
#pragma once

namespace palpate {

/// Starts the program anew by `argv`, at most once for each reason, where OpenBLAS would serve it badly as it
/// has begun: with kernels of another age (kernels_to_ask_for); or with threads of its own where address
/// space is limited, each of which waits for ever for 128 MiB that it does not get. For the first line of
/// `main`: before MPI and threads. Goes on as it is where a program cannot be started.
void start_blas(char** argv);

}  // namespace palpate
