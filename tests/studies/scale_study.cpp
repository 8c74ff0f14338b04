// What compression of the Green's functions costs and how exact it is.
//
//   scale_study MODEL.toml [--leaf N] [--eta ETA] [--cut C,C,...] [--touches N] [--jobs N]
//
// Meshes the model, factorises K and compresses Xi with each cut; a line of a table for each.
#include <cblas.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
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
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/scope.h"
#include "tests/support/column_compression.h"
#include "tests/support/study.h"

namespace palpate {
namespace {

struct Options {
  std::string model;
  ClusterOptions clusters;
  std::vector<double> cut = {1e-2};
  std::int64_t touches = 100;
  double share = 0.2;
  Index tile = 2;
  bool columns = false;
  int jobs = static_cast<int>(std::thread::hardware_concurrency());
};

Options read(int count, char** words) {
  Options options;
  const std::map<std::string, std::function<void(const std::string&)>> known = {
      {"--leaf", [&](const std::string& text) { options.clusters.leaf = std::stoi(text); }},
      {"--eta", [&](const std::string& text) { options.clusters.eta = std::stod(text); }},
      {"--cut", [&](const std::string& text) { options.cut = test::numbers(text); }},
      {"--touches", [&](const std::string& text) { options.touches = std::stoll(text); }},
      {"--share", [&](const std::string& text) { options.share = std::stod(text); }},
      {"--tile", [&](const std::string& text) { options.tile = std::stoi(text); }},
      {"--from", [&](const std::string& text) { options.columns = text == "columns"; }},
      {"--jobs", [&](const std::string& text) { options.jobs = std::stoi(text); }},
  };
  options.model = words[1];
  for (int k = 2; k + 1 < count; k += 2) known.at(words[k])(words[k + 1]);
  return options;
}

/// Seconds since it was asked last.
double lap() {
  static auto last = std::chrono::steady_clock::now();
  static std::clock_t last_cpu = 0;
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - last).count();
  const std::clock_t cpu = std::clock();
  fmt::print("[cpu {:.1f} s] ", double(cpu - last_cpu) / CLOCKS_PER_SEC);
  last = now;
  last_cpu = cpu;
  return seconds;
}

void run(const Options& options) {
  lap();
  const Description description = read_description(options.model);
  MeshedBody meshed = mesh_body(description, [](const std::string&) {});
  Model model;
  for (const MaterialPart& part : description.materials) model.materials.push_back(part.material);
  model.material_of_element = meshed.material_of_element;
  model.fixed = meshed.fixed;
  model.mesh = meshed.mesh;
  model.surface = surface_simplices(meshed.surface);
  ElasticBody body = elastic_body(model);
  body.prescribed = meshed.prescribed;
  const Stiffness stiffness = assemble_stiffness(body);
  fmt::print("mesh and K: {} nodes, {} dofs, {:.1f} s\n", model.mesh.nodes.size(), stiffness.K.rows(), lap());
  openblas_set_num_threads(1);
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  fmt::print("factor: {:.1f} million entries, {:.1f} s\n", 1e-6 * double(factor.entries()), lap());

  const std::vector<std::uint8_t> stored =
      stored_dof_marks(model.mesh, meshed.surface, stiffness, description.scope, description.layers);
  const int d = model.dimension();
  std::vector<std::int64_t> dof_of_mesh(model.mesh.nodes.size() * std::size_t(d), -1);
  std::vector<Index> mesh_nodes;
  for (std::size_t k = 0; k < stored.size(); ++k) {
    if (!stored[k]) continue;
    const std::int64_t dof = stiffness.free_dofs[k];
    dof_of_mesh[std::size_t(dof)] = std::int64_t(k);
    const auto node = Index(dof / d);
    if (mesh_nodes.empty() || mesh_nodes.back() != node) mesh_nodes.push_back(node);
  }
  std::vector<Vec3> points;
  for (const Index node : mesh_nodes) points.push_back(model.mesh.nodes[std::size_t(node)]);
  const ClusteredNodes clusters = cluster_nodes(points, options.clusters);
  std::vector<std::int64_t> stored_dofs;
  std::vector<Vec3> ordered;
  std::vector<Index> touchable;
  std::vector<bool> on_surface(model.mesh.nodes.size(), false);
  for (const Index node : model.surface) on_surface[std::size_t(node)] = true;
  for (const Index k : clusters.order) {
    const Index node = mesh_nodes[std::size_t(k)];
    if (on_surface[std::size_t(node)] && model.fixed[std::size_t(node)] == 0)
      touchable.push_back(Index(ordered.size()));
    ordered.push_back(points[std::size_t(k)]);
    for (int axis = 0; axis < d; ++axis) stored_dofs.push_back(dof_of_mesh[std::size_t(d * node + axis)]);
  }
  fmt::print("stored nodes: {}, {} levels, {} near and {} far pairs, {:.1f} s\n", points.size(),
             clusters.tree.levels, clusters.near_pair.size(), clusters.far_pair.size(), lap());

  std::optional<Compression> compression;
  std::optional<HierarchicalMatrix> finer;
  if (options.columns) {
    test::ColumnCompression columns(factor, stored_dofs, d, clusters, options.jobs, options.tile);
    fmt::print("columns: {:.3g} Tflop\n", 1e-12 * columns.flops());
    std::fflush(stdout);
    finer = columns.compress(options.share * options.cut.front());
    const test::ColumnTimes& t = columns.times();
    fmt::print("columns: solves {:.1f}, tiles {:.1f}, joining {:.1f} s of processor time\n", t.solves, t.tiles, t.joining);
    fmt::print("columns: {:.1f} s, {:.3f} GB kept\n", lap(), 1e-9 * double(columns.kept_bytes()));
  } else {
    compression.emplace(factor, stored_dofs, d, clusters, options.jobs,
                        [](CompressionStage, double) { return true; });
    compression->prepare();
    fmt::print("near pairs and random loads: {:.1f} s\n", lap());
  }
  std::fflush(stdout);
  for (const double cut : options.cut) {
    const auto matrix = finer ? std::make_shared<HierarchicalMatrix>(recompressed(*finer, cut, options.jobs))
                              : compression->compress(cut);
    fmt::print("cut {:g}: {:.1f} s\n", cut, lap());
    const auto gigabytes = [](std::int64_t floats) { return 4e-9 * double(floats); };
    const double dense = 4e-9 * 0.5 * double(matrix->order()) * double(matrix->order());
    fmt::print(
        "  near {:.3f} GB, bases {:.3f}, transfers {:.3f}, couplings {:.3f}: {:.3f} GB; packed {:.3f}\n",
        gigabytes(matrix->near_at.back()), gigabytes(matrix->basis_at.back()),
        gigabytes(matrix->transfer_at.back()), gigabytes(matrix->coupling_at.back()),
        1e-9 * double(matrix->bytes()), dense);
    for (int level = 1; level <= matrix->tree.levels; ++level) {
      const auto first = matrix->rank.begin() + matrix->tree.first_of_level(level);
      std::vector<Index> ranks(first, first + (1 << level));
      std::sort(ranks.begin(), ranks.end());
      fmt::print("  level {}: ranks {} to {}, median {}\n", level, ranks.front(), ranks.back(),
                 ranks[ranks.size() / 2]);
    }
    const auto errors = certify(*matrix, factor, stored_dofs, ordered, touchable, options.touches, 100000,
                                options.jobs, [](double) { return true; });
    for (const TouchErrors& e : errors)
      fmt::print(
          "  touches of {} nodes: median {:.2e}, 99 % {:.2e}, worst {:.2e}; {} bounds, force off by {:.3f} "
          "(median) to {:.2f} of them\n",
          e.nodes, e.quantile(0.5), e.quantile(0.99), e.quantile(1.0), e.bound_shares.size(),
          e.bound_shares.empty() ? 0.0 : e.bound_shares[e.bound_shares.size() / 2],
          e.bound_shares.empty() ? 0.0 : e.bound_shares.back());
    fmt::print("  {:.1f} s\n", lap());
  }
}

}  // namespace
}  // namespace palpate

int main(int count, char** words) {
  if (count < 2) {
    std::fputs(
        "usage: scale_study MODEL.toml [--leaf N] [--eta ETA] [--cut C,...] [--touches N] [--jobs N]\n",
        stderr);
    return 2;
  }
  try {
    palpate::run(palpate::read(count, words));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
