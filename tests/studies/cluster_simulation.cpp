// A bake by ranks on a simulated cluster: the ranks' own loop, whose tiles take measured times.
//
//   smpirun -np RANKS -platform FILE -hostfile FILE cluster_simulation FIGURES THREADS
//
// Built by scripts/studies/cluster with smpicxx. FIGURES is what tile_study prints. Prints, in seconds: what
// comes before the columns, the columns, sealing the file, and what threads worked in columns.
#include <mpi.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <simgrid/s4u.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "precompute/cluster/rank_team.h"

namespace palpate {
namespace {

namespace s4u = simgrid::s4u;

constexpr double host_speed = 1e9;  // of the platform [flop/s]: a second is so many

struct Figures {
  std::map<std::string, double> seconds;  ///< and other numbers by name
  std::vector<Tile> tiles;                ///< with seconds as their cost
  std::vector<double> bytes;              ///< of each tile
};

/// Lines "name number" and "tile first count seconds bytes".
Figures read_figures(const std::string& file) {
  Figures figures;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    if (name == "tile") {
      Tile tile;
      double bytes = 0.0;
      words >> tile.first >> tile.count >> tile.cost >> bytes;
      figures.tiles.push_back(tile);
      figures.bytes.push_back(bytes);
    } else {
      words >> figures.seconds[name];
    }
  }
  return figures;
}

void compute(double seconds) {
  s4u::this_actor::execute(seconds * host_speed);
}

void run(const Figures& figures, int threads) {
  RankTeam team;
  team.form(FactorOf::rank);
  s4u::Host* const here = s4u::this_actor::get_host();
  s4u::Host* const storage = s4u::Host::by_name("storage");
  const auto& seconds = figures.seconds;
  compute(seconds.at("before"));
  team.share("begun");
  const double begun = s4u::Engine::get_clock();
  double worked = 0.0;
  TileWork work;
  work.solve = [&](const Tile& tile, int) {
    compute(tile.cost);
    const auto k = static_cast<std::size_t>(tile.first / figures.tiles.front().count);
    s4u::Comm::sendto(here, storage, static_cast<std::uint64_t>(figures.bytes[k]));
    team.tell("columns");
  };
  work.done = [&](const Tile& tile) { worked += tile.cost; };
  work.interrupted = [] { return false; };
  team.work(figures.tiles, threads, work);
  if (team.leads()) {
    const double solved = s4u::Engine::get_clock();
    double file = 0.0;
    for (const double bytes : figures.bytes) file += bytes;
    s4u::Comm::sendto(storage, here, static_cast<std::uint64_t>(file));  // read for its checksum
    std::printf("figures %g %g %g %g\n", begun, solved - begun, s4u::Engine::get_clock() - solved, worked);
    std::fflush(stdout);
  }
  team.end();
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  if (argc == 3) palpate::run(palpate::read_figures(argv[1]), std::stoi(argv[2]));
  MPI_Finalize();
  return 0;
}
