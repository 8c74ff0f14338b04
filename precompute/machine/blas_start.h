// Start of OpenBLAS.
#pragma once

namespace palpate {

/// Restarts the program with `argv`, at most once for each reason, if OpenBLAS would serve it badly
/// otherwise: with kernels of an old processor (kernels_to_ask_for); or with threads of its own while address
/// space is limited, each of which waits forever for 128 MiB that it does not get. Must be the first line of
/// `main`: before MPI and threads. Continues unchanged if a program cannot be started.
void start_blas(char** argv);

}  // namespace palpate
