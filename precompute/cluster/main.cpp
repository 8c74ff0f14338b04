// palpate-precompute-mpi: palpate-precompute on ranks of MPI.
#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <string_view>
#include <thread>

#include "base/error.h"
#include "base/program.h"
#include "precompute/cluster/rank_commands.h"
#include "precompute/cluster/rank_team.h"
#include "precompute/machine/blas_start.h"

namespace palpate {
namespace {

constexpr const char* program = "palpate-precompute-mpi";
constexpr std::chrono::seconds leader_first{10};  // most errors occur on all ranks, and the leader reports
                                                  // them

/// An error of a rank other than the leader, with its place.
Error of_rank(const Error& error, const RankTeam& team) {
  std::array<char, 256> host = {};
  ::gethostname(host.data(), host.size() - 1);
  const std::string rank = "rank " + std::to_string(team.rank()) + " on " + host.data();
  return {error.what(), error.where().empty() ? rank : rank + ": " + error.where(), error.hint()};
}

/// Runs the command line. Sets `failed` if it threw: the other ranks then wait in vain.
int run_ranks(int argc, char** argv, bool& failed) {
  RankTeam team;
  try {
    int allowed = 0;
    MPI_Query_thread(&allowed);
    if (allowed < MPI_THREAD_SERIALIZED)
      throw Error("this MPI is called by one thread only, and threads draw what they solve", "MPI",
                  "Use an MPI with threads: most have them");
    const int status = run_rank_commands(argc, argv, team);
    team.end();
    return status;
  } catch (...) {
    failed = true;
    const Error error = handled_error(program, "try --dry-run, and fewer --jobs or ranks on a node");
    if (team.leads()) throw error;
    std::this_thread::sleep_for(leader_first);
    throw of_rank(error, team);
  }
}

/// True if the command line only asks for help, which needs no ranks.
bool asks_for_help(int argc, char** argv) {
  return std::any_of(argv + 1, argv + argc, [](const char* argument) {
    const std::string_view word = argument;
    return word == "help" || word == "--help" || word == "-h" || word == "--version";
  });
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::start_blas(argv);
  palpate::end_with_an_error_on_shrunk_files();
  if (palpate::asks_for_help(argc, argv)) {
    return palpate::run_program(palpate::program, "", [&] {
      palpate::Team alone;
      return palpate::run_rank_commands(argc, argv, alone);
    });
  }
  int provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_SERIALIZED, &provided);
  bool failed = false;
  const int status =
      palpate::run_program(palpate::program, "", [&] { return palpate::run_ranks(argc, argv, failed); });
  if (failed) MPI_Abort(MPI_COMM_WORLD, status);
  MPI_Finalize();
  return status;
}
