// MPI calls that leave the processor to working threads.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <thread>

namespace palpate {

/// Waits without using a processor: MPI's own waiting would take one from the threads that solve.
inline void wait(MPI_Request& request) {
  auto pause = std::chrono::microseconds(20);
  for (int done = 0;;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) return;
    std::this_thread::sleep_for(pause);
    pause = std::min<std::chrono::microseconds>(5 * pause / 4, std::chrono::milliseconds(5));
  }
}

/// Broadcasts from one rank to all.
inline void broadcast(void* data, int count, MPI_Datatype type, MPI_Comm comm, int from = 0) {
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(data, count, type, from, comm, &request);
  wait(request);
}

inline int rank_in(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

inline int size_of(MPI_Comm comm) {
  int size = 0;
  MPI_Comm_size(comm, &size);
  return size;
}

}  // namespace palpate
