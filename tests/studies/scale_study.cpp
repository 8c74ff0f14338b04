// What compression of the Green's functions costs and how exact it is.
//
//   scale_study MODEL.toml [--from loads|columns] [--sample TILES] [--share S] [--tile LEAVES] [--leaf N]
//               [--eta ETA] [--cut C,C,...] [--touches N] [--jobs N]
//
// Meshes the model, factorises K and compresses Xi with each cut; some lines for each. `loads`: as precompute
// does. `columns`: from all columns, tile by tile, S times as exact as the first cut before they are
// recompressed; --sample solves for some tiles only and says what all would take.
#include <cblas.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "precompute/compression/certificate.h"
#include "precompute/compression/compression.h"
#include "precompute/compression/recompression.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/scope.h"
#include "tests/support/compression/column_compression.h"
#include "tests/support/study.h"

namespace palpate {
namespace {

struct Options {
  std::string model;
  ClusterOptions clusters;
  std::vector<double> cut = {1e-2};
  std::int64_t touches = 100;
  std::string from = "loads";
  double share = 0.1;
  Index tile = 4, sample = 0;
  int jobs = static_cast<int>(std::thread::hardware_concurrency());
};

Options read(int count, char** words) {
  Options options;
  options.model = test::read_options(
      count, words,
      {{"--leaf", [&](const std::string& text) { options.clusters.leaf = std::stoi(text); }},
       {"--eta", [&](const std::string& text) { options.clusters.eta = std::stod(text); }},
       {"--cut", [&](const std::string& text) { options.cut = test::numbers(text); }},
       {"--touches", [&](const std::string& text) { options.touches = std::stoll(text); }},
       {"--from", [&](const std::string& text) { options.from = text; }},
       {"--sample", [&](const std::string& text) { options.sample = std::stoi(text); }},
       {"--share", [&](const std::string& text) { options.share = std::stod(text); }},
       {"--tile", [&](const std::string& text) { options.tile = std::stoi(text); }},
       {"--jobs", [&](const std::string& text) { options.jobs = std::stoi(text); }}});
  return options;
}

/// Says how long it is since it was asked last, by the clock and of the processors.
std::string lap() {
  static auto last = std::chrono::steady_clock::now();
  static std::clock_t last_clock = 0;
  const auto now = std::chrono::steady_clock::now();
  const std::clock_t clock = std::clock();
  std::string text =
      fmt::format("{:.1f} s, of processors {:.1f} s", std::chrono::duration<double>(now - last).count(),
                  double(clock - last_clock) / double{CLOCKS_PER_SEC});
  last = now;
  last_clock = clock;
  return text;
}

/// A body, meshed and factorised, and its stored nodes in clusters.
struct Problem {
  Model model;
  Stiffness stiffness;
  std::optional<Factor> factor;
  ClusteredNodes clusters;
  std::vector<std::int64_t> stored_dofs;
  TouchablePoints places;
};

void number_stored_nodes(const std::vector<std::uint8_t>& stored, const ClusterOptions& options,
                         Problem& problem) {
  const int d = problem.model.dimension();
  std::vector<Index> in_mesh_order, nodes;
  for (std::size_t k = 0; k < stored.size(); ++k) {
    const auto node = Index(problem.stiffness.free_dofs[k] / d);
    if (stored[k] != 0 && (in_mesh_order.empty() || in_mesh_order.back() != node))
      in_mesh_order.push_back(node);
  }
  std::vector<Vec3> points;
  points.reserve(in_mesh_order.size());
  for (const Index node : in_mesh_order) points.push_back(problem.model.mesh.nodes[std::size_t(node)]);
  problem.clusters = cluster_nodes(points, options);
  for (const Index k : problem.clusters.order) {
    nodes.push_back(in_mesh_order[std::size_t(k)]);
    for (int axis = 0; axis < d; ++axis)
      problem.stored_dofs.push_back(
          problem.stiffness.free_of_dof[std::size_t(std::int64_t{d} * nodes.back() + axis)]);
  }
  problem.places = touchable_points(problem.model, nodes);
}

void prepare(const Options& options, Problem& problem) {
  lap();
  const Description description = read_description(options.model);
  MeshedBody meshed = mesh_body(description, [](const std::string&) {});
  Model& model = problem.model;
  for (const MaterialPart& part : description.materials) model.materials.push_back(part.material);
  model.material_of_element = meshed.material_of_element;
  model.fixed = meshed.fixed;
  model.mesh = meshed.mesh;
  model.surface = surface_simplices(meshed.surface);
  StiffnessInput body = stiffness_input(model);
  body.prescribed = meshed.prescribed;
  problem.stiffness = assemble_stiffness(body);
  fmt::print("mesh and K: {} nodes, {} dofs: {}\n", model.mesh.nodes.size(), problem.stiffness.K.rows(),
             lap());
  openblas_set_num_threads(1);
  problem.factor.emplace(problem.stiffness.K, problem.stiffness.node_start).factorize();
  fmt::print("factor: {:.1f} million entries: {}\n", 1e-6 * double(problem.factor->entries()), lap());
  number_stored_nodes(
      stored_dof_marks(model.mesh, meshed.surface, problem.stiffness, description.scope, description.layers),
      options.clusters, problem);
  std::vector<Index> surface(model.surface.begin(), model.surface.end());
  std::sort(surface.begin(), surface.end());
  fmt::print("stored nodes: {} of {} of the surface, {} levels, {} near and {} far pairs: {}\n",
             problem.places.points.size(), std::unique(surface.begin(), surface.end()) - surface.begin(),
             problem.clusters.tree.levels, problem.clusters.near_pair.size(),
             problem.clusters.far_pair.size(), lap());
}

void report(const HierarchicalMatrix& matrix, const Options& options, const Problem& problem) {
  const auto gigabytes = [](std::int64_t floats) { return 4e-9 * double(floats); };
  fmt::print("  near {:.3f} GB, bases {:.3f}, transfers {:.3f}, couplings {:.3f}: {:.3f} GB; packed {:.3f}\n",
             gigabytes(matrix.near_at.back()), gigabytes(matrix.basis_at.back()),
             gigabytes(matrix.transfer_at.back()), gigabytes(matrix.coupling_at.back()),
             1e-9 * double(matrix.bytes()), 0.5 * gigabytes(matrix.order() * matrix.order()));
  for (int level = 1; level <= matrix.tree.levels; ++level) {
    const auto first = matrix.rank.begin() + matrix.tree.first_of_level(level);
    std::vector<Index> ranks(first, first + (1 << level));
    std::sort(ranks.begin(), ranks.end());
    fmt::print("  level {}: ranks {} to {}, median {}\n", level, ranks.front(), ranks.back(),
               ranks[ranks.size() / 2]);
  }
  ThreadSharing threads(options.jobs);
  const auto errors =
      certify(matrix, *problem.factor, problem.stored_dofs, problem.places.points, problem.places.touchable,
              options.touches, 100000, threads, [](double) { return true; });
  for (const TouchErrors& e : errors) {
    fmt::print(
        "  touches of {} nodes: median {:.2e}, 99 % {:.2e}, worst {:.2e}; {} bounds, force off by {:.3f} "
        "(median) to {:.2f} of them\n",
        e.nodes, e.quantile(0.5), e.quantile(0.99), e.quantile(1.0), e.bound_shares.size(),
        e.bound_shares.empty() ? 0.0 : e.bound_shares[e.bound_shares.size() / 2],
        e.bound_shares.empty() ? 0.0 : e.bound_shares.back());
  }
  fmt::print("  touches: {}\n", lap());
  std::fflush(stdout);
}

void from_loads(const Options& options, const Problem& problem) {
  ThreadSharing threads(options.jobs);
  Compression compression(*problem.factor, problem.stored_dofs, problem.model.dimension(), problem.clusters,
                          threads, std::int64_t{1} << 30, [](CompressionStage, double) { return true; });
  compression.prepare();
  fmt::print("near pairs and random loads: {}\n", lap());
  std::fflush(stdout);
  for (const double cut : options.cut) {
    const auto matrix = compression.compress(cut);
    fmt::print("cut {:g}: {}\n", cut, lap());
    report(*matrix, options, problem);
  }
}

void from_columns(const Options& options, const Problem& problem) {
  std::optional<test::ColumnCompression> columns;
  columns.emplace(*problem.factor, problem.stored_dofs, problem.model.dimension(), problem.clusters,
                  options.jobs, options.tile);
  const double cut = options.share * options.cut.front();
  fmt::print("columns: {:.3g} Tflop: {}\n", 1e-12 * columns->flops(), lap());
  std::fflush(stdout);
  const auto print = [](const test::ColumnTimes& t) {
    fmt::print("of processors: columns {:.1f} s, compression of leaves {:.1f} s, joining {:.1f} s\n",
               t.solves, t.leaves, t.joining);
  };
  if (options.sample > 0) {
    print(columns->estimate(cut, options.sample));
    return;
  }
  const HierarchicalMatrix finer = columns->compress(cut);
  print(columns->times());
  fmt::print("all columns: {}; {:.3f} GB kept\n", lap(), 1e-9 * double(columns->kept_bytes()));
  columns.reset();
  std::fflush(stdout);
  ThreadSharing threads(options.jobs);
  for (const double coarser : options.cut) {
    const HierarchicalMatrix matrix = recompressed(finer, coarser, threads).value();
    fmt::print("cut {:g}: {}\n", coarser, lap());
    report(matrix, options, problem);
  }
}

}  // namespace
}  // namespace palpate

int main(int count, char** words) {
  try {
    const palpate::Options options = palpate::read(count, words);
    palpate::Problem problem;
    palpate::prepare(options, problem);
    std::fflush(stdout);
    options.from == "columns" ? palpate::from_columns(options, problem)
                              : palpate::from_loads(options, problem);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
