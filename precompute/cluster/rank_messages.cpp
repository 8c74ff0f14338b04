#include "precompute/cluster/rank_messages.h"

namespace palpate {

void broadcast(void* data, int count, MPI_Datatype type, MPI_Comm comm) {
  if (size_of(comm) == 1) return;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(data, count, type, 0, comm, &request);
  wait(request);
}

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
