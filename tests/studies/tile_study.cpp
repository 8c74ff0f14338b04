// What the parts of a bake by ranks take, for scripts/studies/cluster.
//
//   tile_study MODEL.toml [--samples N]
//
// Meshes the model, factorises K, and solves and writes N of its blocks of columns of each width, by one
// thread. Prints its processor's seconds, those of the other blocks by the flops of as wide ones: "before",
// "factor", "tile FIRST COUNT SECONDS BYTES".
#include <cblas.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "base/file_io.h"
#include "base/program.h"
#include "formats/checksum.h"
#include "precompute/columns.h"
#include "precompute/description/description.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/scope.h"
#include "precompute/plan.h"

namespace palpate {
namespace {

double processor_seconds() {
  timespec time = {};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Converts, sums and writes a block as the file's writer does.
void write_block(const std::vector<double>& packed, std::FILE* file) {
  const std::vector<float> values(packed.begin(), packed.end());
  RunningChecksum sum;
  sum.update(std::as_bytes(std::span(values)));
  std::rewind(file);
  std::fwrite(values.data(), sizeof(float), values.size(), file);
}

/// Seconds per flop of blocks that are `count` columns wide, from `samples` of them.
double measured_rate(const GreensSolver& solver, const std::vector<Tile>& tiles, std::int64_t count,
                     std::int64_t samples, std::FILE* out) {
  std::vector<Tile> as_wide;
  std::copy_if(tiles.begin(), tiles.end(), std::back_inserter(as_wide),
               [&](const Tile& tile) { return tile.count == count; });
  samples = std::min(samples, std::ssize(as_wide));
  GreensSolver::Workspace workspace;
  std::vector<double> packed;
  double spent = 0.0, flops = 0.0;
  for (std::int64_t k = -1; k < samples; ++k) {
    const auto at = static_cast<std::size_t>((2 * std::max<std::int64_t>(k, 0) + 1) * std::ssize(as_wide) /
                                             (2 * samples));
    const double start = processor_seconds();
    solver.columns(as_wide[at].first, count, workspace, packed);
    write_block(packed, out);
    if (k < 0) continue;  // fills the workspace
    spent += processor_seconds() - start;
    flops += as_wide[at].cost;
  }
  return spent / flops;
}

void run(const std::string& file, std::int64_t samples) {
  const Description description = read_description(file);
  MeshedBody body = mesh_body(description, [](const std::string&) {});
  StiffnessInput elastic{.mesh = body.mesh,
                         .analysis = description.analysis,
                         .thickness = description.thickness,
                         .materials = {&description.materials.at(0).material, 1},
                         .material_of_element = body.material_of_element,
                         .fixed = body.fixed,
                         .prescribed = body.prescribed};
  const Stiffness stiffness = assemble_stiffness(elastic);
  openblas_set_num_threads(1);
  Factor factor(stiffness.K, stiffness.node_start);
  const GreensSolver solver(
      factor, stored_dof_marks(body.mesh, body.surface, stiffness, description.scope, description.layers),
      stiffness.free_dofs, body.mesh.dimension());
  const double before = processor_seconds();
  factor.factorize();
  const double factorised = processor_seconds();
  const Plan plan = make_plan(body.mesh, factor, solver, Precision::single_precision, 1);
  const std::vector<Tile> tiles = column_tiles(solver, plan);
  std::map<std::int64_t, double> rate;  // by width
  std::FILE* const out = std::tmpfile();
  for (const Tile& tile : tiles)
    if (!rate.contains(tile.count)) rate[tile.count] = measured_rate(solver, tiles, tile.count, samples, out);
  std::fclose(out);
  fmt::print("nodes {}\nstored_dofs {}\nfactor_entries {}\n", plan.nodes, plan.stored_dofs,
             plan.factor_entries);
  fmt::print("mesh {:.3f}\nfactor {:.3f}\nbefore {:.3f}\n", before, factorised - before, factorised);
  for (const Tile& tile : tiles) {
    const std::int64_t entries =
        tile.count * (plan.stored_dofs - tile.first) - tile.count * (tile.count - 1) / 2;
    fmt::print("tile {} {} {:.6f} {}\n", tile.first, tile.count, tile.cost * rate.at(tile.count),
               entries * static_cast<std::int64_t>(sizeof(float)));
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  return palpate::run_program("tile_study", "", [&] {
    if (argc != 2 && argc != 4) return 2;
    palpate::run(argv[1], argc == 4 ? std::stoll(argv[3]) : 4);
    return 0;
  });
}
