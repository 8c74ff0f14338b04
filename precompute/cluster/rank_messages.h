// Calls of MPI that leave the processor to threads that work.
#pragma once

#include <mpi.h>

namespace palpate {

/// Waits without a processor: MPI's own waiting would take one from the threads that solve.
void wait(MPI_Request& request);

/// From rank 0 to all.
void broadcast(void* data, int count, MPI_Datatype type, MPI_Comm comm);

int rank_in(MPI_Comm comm);
int size_of(MPI_Comm comm);

}  // namespace palpate
