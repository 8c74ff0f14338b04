// What an overlay costs by inversion by partitioning, as the papers had it: from a patch whose stiffness is
// assembled to Xi_G, Xi_LG and Xi_L, the body's Green's functions gathered included. One thread of BLAS.
//
// Bodies: a block of tet4 with cells of 5 mm, touched in the middle of its upper side, and the plate of the
// papers' Table 1 (4 x 4 quad4, 6 x 6 local elements over the 2 x 2 under the contact).
//
// Counters: the local dofs and the patch's nodes; medians of making the patch's mesh, of assembling its
// stiffness, and of the inversion, which is what is timed.
#include <benchmark/benchmark.h>
#include <cblas.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "formats/model_file.h"
#include "precompute/bake.h"
#include "runtime/partitioned_inverse.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

template <class F>
double seconds(F&& f) {
  const Clock::time_point begin = Clock::now();
  f();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A body and the elements that are refined.
struct Patch {
  std::shared_ptr<const Body> body;
  std::vector<Index> elements;
};

void time_partitioning(benchmark::State& run, const Patch& patch, int refinement) {
  const Model& model = patch.body->model();
  const ElementsAtNodes at(model.mesh);
  std::vector<double> cut, assemble, invert;
  while (run.KeepRunning()) {
    PatchMesh mesh;
    cut.push_back(seconds([&] { mesh = make_patch_mesh(model, at, patch.elements, refinement); }));
    PatchStiffness stiffness;
    assemble.push_back(seconds([&] { stiffness = assemble_patch(model, mesh); }));
    std::vector<Index> stored;
    for (const Index node : mesh.nodes) stored.push_back(patch.body->stored_node(node));
    invert.push_back(seconds([&] {
      benchmark::DoNotOptimize(invert_by_partitioning(stiffness, greens_at(*patch.body, stored)));
    }));
    run.SetIterationTime(invert.back());
    run.counters["local_dofs"] = static_cast<double>(mesh.free_dofs);
    run.counters["patch_nodes"] = static_cast<double>(mesh.nodes.size());
  }
  run.counters["mesh_us"] = 1e6 * median(cut);
  run.counters["assemble_us"] = 1e6 * median(assemble);
  run.counters["invert_us"] = 1e6 * median(invert);
}

std::shared_ptr<const Body> bake_body(const std::filesystem::path& model_toml,
                                      const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "body.palpate.hdf";
  bake(read_description(model_toml), {.output = file, .jobs = 1});
  return std::make_shared<const Body>(load_model(file));
}

std::shared_ptr<const Body> bake_block(const std::filesystem::path& folder) {
  std::ofstream(folder / "model.toml") << R"(name = "block"
[geometry]
box = {size = [0.06, 0.06, 0.03], cells = [12, 12, 6]}
[material]
youngs_modulus = 5.5e3
poissons_ratio = 0.45
[[fixed]]
lowest = {axis = "z", percent = 0.1}
[storage]
scope = "full"
precision = "double"
)";
  return bake_body(folder / "model.toml", folder);
}

std::vector<Index> rings_at(const Body& body, const Vec3& place, int rings) {
  const Mesh& mesh = body.model().mesh;
  const std::vector<Index> contact = {body.mesh_node(body.nearest_surface_node(place).node)};
  return rings_round(mesh, ElementsAtNodes(mesh), contact, rings);
}

/// The elements of which all nodes are in a box.
std::vector<Index> elements_in(const Body& body, const Eigen::AlignedBox3d& box) {
  const Mesh& mesh = body.model().mesh;
  std::vector<Index> elements;
  for (Index e = 0; e < mesh.elements(); ++e) {
    const auto nodes = mesh.element_nodes(e);
    if (std::all_of(nodes.begin(), nodes.end(),
                    [&](Index node) { return box.contains(mesh.nodes[static_cast<std::size_t>(node)]); }))
      elements.push_back(e);
  }
  return elements;
}

void add(const std::string& title, const Patch& patch, int refinement) {
#ifndef __clang_analyzer__  // takes what the library keeps for ever for a leak
  benchmark::RegisterBenchmark(
      title.c_str(),
      [patch, refinement](benchmark::State& run) { time_partitioning(run, patch, refinement); })
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
#endif
}

void register_bodies() {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "palpate_overlay_bench";
  std::filesystem::create_directories(folder);
  const auto plate =
      bake_body(std::filesystem::path(PALPATE_SOURCE_DIR) / "meshes/models/plate/model.toml", folder);
  const auto block = bake_block(folder);
  std::filesystem::remove_all(folder);
  constexpr double margin = 1e-9;
  add("partitioning/plate/quads:2x2/r:3",
      {plate, elements_in(*plate, {Vec3(0.25 - margin, 0.5 - margin, -margin),
                                   Vec3(0.75 + margin, 1.0 + margin, margin)})},
      3);
  for (const int rings : {1, 2}) {
    const std::vector<Index> elements = rings_at(*block, Vec3(0.03, 0.03, 0.03), rings);
    for (const int refinement : {2, 3, 4}) {
      add("partitioning/block/rings:" + std::to_string(rings) + "/r:" + std::to_string(refinement),
          {block, elements}, refinement);
    }
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  benchmark::Initialize(&argc, argv);
  palpate::register_bodies();
  benchmark::RunSpecifiedBenchmarks();
}
