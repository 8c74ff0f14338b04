// What an overlay costs.
//
// partitioning: by inversion by partitioning, as the papers had it: from a patch whose stiffness is assembled
// to Xi_G, Xi_LG and Xi_L, the body's Green's functions gathered included. One thread of BLAS. Counters: the
// local dofs and the patch's nodes; medians of making the patch's mesh, of assembling its stiffness, and of
// the inversion, which is what is timed.
//
// patch: what the builder does for a patch. Counters: medians of its mesh, its condensation and the rest; its
// size; the force that displaces the node in the middle by 1 m along the last axis with the others held, and
// that of the mesh alone.
//
// switch: a tick in which a tool that rests on the body is given another patch, of the node next to the one
// before. Counters: medians of such ticks and of those between, their difference, and how many nodes are
// near.
//
// held: a tick with a patch while a tool holds the surface, so that it has the same contact points whatever
// the body's compliance. Counters: medians with the patch, and without, in turn; their difference.
//
// Bodies: a block of tet4 with cells of 5 mm, touched in the middle of its upper side, and the plate of the
// papers' Table 1 (4 x 4 quad4, 6 x 6 local elements over the 2 x 2 under the contact; patches are those of
// the two elements at its node); with PALPATE_BENCH_MODEL=NAME.palpate.hdf that body, at its highest free
// node.
#include <benchmark/benchmark.h>
#include <cblas.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "formats/model_file.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"
#include "runtime/body/make_patch.h"
#include "runtime/body/patch_maker.h"
#include "runtime/core/tick/step.h"
#include "tests/support/folders.h"
#include "tests/support/second_routes/partitioned_inverse.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr benchmark::IterationCount ticks = 2000;  // that are timed

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
struct Refined {
  std::shared_ptr<const Body> body;
  std::vector<Index> elements;
};

void time_partitioning(benchmark::State& run, const Refined& patch, int refinement) {
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

/// A file, and where a tool touches the body.
struct Touched {
  std::string name;
  std::filesystem::path file;
  double radius;  // of the tool [m]
  double depth;   // [m]
};

/// Where tools and patches are: the free surface node that is highest along the last axis, nearest to the
/// middle.
Index top_node(const Body& body) {
  const int up = body.dimension() - 1;
  const Vec3 middle = body.bounds().center();
  Index best = body.free_surface_nodes().front();
  const auto badness = [&](Index node) {
    const Vec3 x = body.rest_position(node);
    const Vec3 beside = x - middle;
    return std::pair(-std::round(1e6 * x[up]), beside.squaredNorm());
  };
  for (const Index node : body.free_surface_nodes()) {
    if (badness(node) < badness(best)) best = node;
  }
  return best;
}

/// A body with a fine surface, a tool that is pressed on it, and the patches of its node and of one beside
/// it.
struct Overlaid {
  Body body;
  PatchMaker maker;
  Index centre;
  State state;
  ToolPose pose;

  Overlaid(const Touched& touched, int refinement, int rings)
      : body(load_model(touched.file), {}, refinement),
        maker(body, rings),
        centre(top_node(body)),
        state(body, {.tools = {Tool{.radius = touched.radius, .reach = 10.0 * touched.radius}},
                     .patch_nodes = patch_room(body, rings, 2)}) {
    const Vec3 up = Vec3::Unit(body.dimension() - 1);
    for (int k = 200; k >= 0; --k) {
      pose.position =
          body.rest_position(centre) + (touched.radius - touched.depth + 0.01 * k * 2.0 * touched.depth) * up;
      step(body, state, pose);
    }
  }
  [[nodiscard]] std::shared_ptr<const Patch> patch(Index node) { return maker.make({&node, 1}); }
};

void time_patch(benchmark::State& run, const Touched& touched, int refinement, int rings) {
  Overlaid overlaid(touched, refinement, rings);
  const Body& body = overlaid.body;
  const Model& model = body.model();
  const ElementsAtNodes at(model.mesh);
  Subdivisions cuts(model.mesh.element, refinement);
  const Index node = body.mesh_node(overlaid.centre);
  std::vector<double> cut, condensed, rest, all;
  std::shared_ptr<const Patch> patch;
  while (run.KeepRunning()) {
    PatchMesh mesh;
    cut.push_back(seconds([&] {
      mesh = make_patch_mesh(model, at, cuts, rings_round(model.mesh, at, {&node, 1}, rings));
    }));
    CondensedPatch inner;
    condensed.push_back(seconds([&] { inner = condense(model, mesh); }));
    rest.push_back(seconds([&] { patch = make_patch(body, mesh, inner); }));
    all.push_back(cut.back() + condensed.back() + rest.back());
    run.SetIterationTime(all.back());
    run.counters["local_dofs"] = static_cast<double>(mesh.free_dofs);
  }
  run.counters["patch_nodes"] = static_cast<double>(patch->stored_nodes().size());
  run.counters["surface_nodes"] = static_cast<double>(patch->surface_nodes().size());
  run.counters["MB"] = 1e-6 * static_cast<double>(patch->bytes());
  run.counters["build_us"] = 1e6 * median(all);
  run.counters["mesh_us"] = 1e6 * median(cut);
  run.counters["condense_us"] = 1e6 * median(condensed);
  run.counters["rest_us"] = 1e6 * median(rest);
  const int d = body.dimension();
  const Index surface = body.surface_node_of_stored(overlaid.centre);
  const auto nodes = patch->surface_nodes();
  const auto place = static_cast<Index>(std::find(nodes.begin(), nodes.end(), surface) - nodes.begin());
  Eigen::MatrixXd compliance(d, d);
  for (int i = 0; i < d; ++i) {
    for (int j = 0; j < d; ++j) compliance(i, j) = patch->compliance(d * place + i)[d * place + j];
  }
  run.counters["force"] = compliance.inverse()(d - 1, d - 1);
  run.counters["force_without"] =
      body.greens().block(overlaid.centre, overlaid.centre).inverse()(d - 1, d - 1);
}

void time_switch(benchmark::State& run, const Touched& touched, int refinement, int rings) {
  Overlaid overlaid(touched, refinement, rings);
  State& state = overlaid.state;
  const std::vector<Index> neighbours = overlaid.maker.neighbours(overlaid.centre);
  const std::array<std::shared_ptr<const Patch>, 2> patches = {overlaid.patch(overlaid.centre),
                                                               overlaid.patch(neighbours.front())};
  std::vector<double> changes, between;
  std::size_t turn = 0;
  double near = 0.0;
  while (run.KeepRunning()) {
    state.surface.patch = patches[turn++ % 2];
    changes.push_back(seconds([&] { step(overlaid.body, state, overlaid.pose); }));
    near += state.surface.near.count();
    for (int k = 0; k < 20; ++k)
      between.push_back(seconds([&] { step(overlaid.body, state, overlaid.pose); }));
    run.SetIterationTime(changes.back());
  }
  run.counters["switch_us"] = 1e6 * median(changes);
  run.counters["between_us"] = 1e6 * median(between);
  run.counters["more_us"] = 1e6 * (median(changes) - median(between));
  run.counters["near_nodes"] = near / static_cast<double>(changes.size());
  run.counters["contacts"] = state.tools.front().contacts;
}

void time_held(benchmark::State& run, const Touched& touched, int refinement, int rings) {
  Overlaid overlaid(touched, refinement, rings);
  overlaid.state.surface.patch = overlaid.patch(overlaid.centre);
  ToolPose pose = overlaid.pose;
  step(overlaid.body, overlaid.state, pose);
  pose.grab = true;
  State with = overlaid.state;
  for (int k = 0; k < 100; ++k) step(overlaid.body, with, pose);
  State without = with;
  without.surface.patch = nullptr;
  for (int k = 0; k < 100; ++k) step(overlaid.body, without, pose);
  std::vector<double> times_with, times_without;
  int turn = 0;
  const auto tick = [&](State& state, std::vector<double>& times) {
    for (int k = 0; k < 20; ++k) {
      pose.position = overlaid.pose.position + 0.1 * touched.depth * std::sin(0.01 * turn) * Vec3::UnitX();
      times.push_back(seconds([&] { step(overlaid.body, state, pose); }));
    }
  };
  while (run.KeepRunning()) {
    ++turn;
    tick(with, times_with);
    tick(without, times_without);
    run.SetIterationTime(times_with.back());
  }
  run.counters["with_us"] = 1e6 * median(times_with);
  run.counters["without_us"] = 1e6 * median(times_without);
  run.counters["more_us"] = 1e6 * (median(times_with) - median(times_without));
  run.counters["contacts_with"] = with.contact_count;
  run.counters["contacts_without"] = without.contact_count;
}

std::filesystem::path bake_body(const std::filesystem::path& model_toml, const std::filesystem::path& file) {
  bake(read_description(model_toml), {.output = file, .jobs = 1});
  return file;
}

std::filesystem::path bake_block(const std::filesystem::path& folder) {
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
  return bake_body(folder / "model.toml", folder / "block.palpate.hdf");
}

std::vector<Index> rings_at(const Body& body, int rings) {
  const Mesh& mesh = body.model().mesh;
  const std::vector<Index> contact = {body.mesh_node(top_node(body))};
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

template <class F>
void add(const std::string& title, F&& function, benchmark::IterationCount iterations = 0) {
#ifndef __clang_analyzer__  // takes what the library keeps for ever for a leak
  auto* added = benchmark::RegisterBenchmark(title.c_str(), std::forward<F>(function))
                    ->UseManualTime()
                    ->Unit(benchmark::kMicrosecond);
  if (iterations > 0) added->Iterations(iterations);
#endif
}

void register_body(const Touched& touched, const std::vector<int>& refinements) {
  const auto body = std::make_shared<const Body>(load_model(touched.file));
  for (const int rings : {1, 2}) {
    if (body->dimension() == 2 && rings > 1) break;
    const Refined refined{body, rings_at(*body, rings)};
    for (const int r : refinements) {
      const std::string title =
          "/" + touched.name + "/rings:" + std::to_string(rings) + "/r:" + std::to_string(r);
      add("partitioning" + title, [=](benchmark::State& run) { time_partitioning(run, refined, r); });
      add("patch" + title, [=](benchmark::State& run) { time_patch(run, touched, r, rings); });
      add(
          "switch" + title, [=](benchmark::State& run) { time_switch(run, touched, r, rings); }, ticks);
      add(
          "held" + title, [=](benchmark::State& run) { time_held(run, touched, r, rings); }, ticks);
    }
  }
}

void register_bodies(const std::filesystem::path& folder) {
  const char* file = std::getenv("PALPATE_BENCH_MODEL");
  if (file != nullptr) {
    register_body({.name = "model", .file = file, .radius = 0.005, .depth = 0.002}, {2, 3, 4});
    return;
  }
  const std::filesystem::path model = palpate::test::source_file("meshes/models/plate/model.toml");
  const Touched plate{
      .name = "plate", .file = bake_body(model, folder / "plate.palpate.hdf"), .radius = 0.1, .depth = 0.02};
  const auto body = std::make_shared<const Body>(load_model(plate.file));
  constexpr double margin = 1e-9;
  const Refined under{body, elements_in(*body, {Vec3(0.25 - margin, 0.5 - margin, -margin),
                                                Vec3(0.75 + margin, 1.0 + margin, margin)})};
  add("partitioning/plate/quads:2x2/r:3", [=](benchmark::State& run) { time_partitioning(run, under, 3); });
  register_body(plate, {3});
  register_body({.name = "block", .file = bake_block(folder), .radius = 0.0025, .depth = 0.001}, {2, 3, 4});
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  benchmark::Initialize(&argc, argv);
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "palpate_overlay_bench";
  std::filesystem::create_directories(folder);
  palpate::register_bodies(folder);
  benchmark::RunSpecifiedBenchmarks();
  std::filesystem::remove_all(folder);
}
