#include "precompute/cluster/rank_messages.h"

#include <algorithm>
#include <chrono>

#include "precompute/cluster/rank_threads.h"

namespace palpate {

void wait(MPI_Request& request) {
  auto pause = std::chrono::microseconds(20);
  for (int done = 0;;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) return;
    pause_for(pause);
    pause = std::min<std::chrono::microseconds>(2 * pause, std::chrono::milliseconds(5));
  }
}

void broadcast(void* data, int count, MPI_Datatype type, MPI_Comm comm) {
  if (size_of(comm) == 1) return;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(data, count, type, 0, comm, &request);
  wait(request);
}  // NOLINT(clang-analyzer-optin.mpi.MPI-Checker): `wait` tests it until it is done

int rank_in(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

int size_of(MPI_Comm comm) {
  int size = 0;
  MPI_Comm_size(comm, &size);
  return size;
}

}  // namespace palpate
