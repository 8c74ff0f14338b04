// Calls of MPI that leave the processor to threads that work.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <chrono>

#include "precompute/cluster/rank_threads.h"

namespace palpate {

/// Waits without a processor: MPI's own waiting would take one from the threads that solve.
inline void wait(MPI_Request& request) {
  auto pause = std::chrono::microseconds(20);
  for (int done = 0;;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) return;
    pause_for(pause);
    pause = std::min<std::chrono::microseconds>(5 * pause / 4, std::chrono::milliseconds(5));
  }
}

/// From rank 0 to all.
void broadcast(void* data, int count, MPI_Datatype type, MPI_Comm comm);

int rank_in(MPI_Comm comm);
int size_of(MPI_Comm comm);

}  // namespace palpate
