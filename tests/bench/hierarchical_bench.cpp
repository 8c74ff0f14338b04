// What a tick asks of compressed Green's functions, beside the same of dense ones: compressed/... and
// dense/... of one body in one run.
//
//   hierarchical_bench [--benchmark_filter=...]
//
// A generated block with 4 000 free surface nodes, and the liver where meshes/models/liver/liver.inr.gz is
// (scripts/demo and scripts/test put it there). PALPATE_BENCH_MODEL=DIR/model.toml measures that body
// instead. PALPATE_BENCH_MODEL=NAME.palpate.hdf, a compressed model, measures new_node/... alone: there is
// nothing dense beside 100 000 surface nodes.
//
// new_node/N: what a node that comes into contact costs beside N that are: its blocks at them and itself.
// /walk: the nodes come one after another around a place, as under a tool that moves; /cold: each comes at
// another place, and nothing of the matrix is in a cache. Counters: median, 99.9 % and worst [us];
// work_99.9%: of the least time of each arrival in ten rounds, without what else the machine does. The times
// of /cold are with what empties the caches.
#include <benchmark/benchmark.h>
#include <cblas.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "formats/model_file.h"
#include "meshes/generate.h"
#include "precompute/compression/compression.h"
#include "precompute/compression/selected_solver.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/scope.h"
#include "runtime/core/body/greens.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/compression/clustered_body.h"
#include "tests/support/folders.h"

namespace palpate {
namespace {

/// Both forms of the Green's functions of one body.
struct Forms {
  std::shared_ptr<const Greens> compressed, dense;
  std::vector<Vec3> points;
  std::int64_t compressed_bytes = 0, dense_bytes = 0;
};

int processors() {
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

/// Xi by blocks of columns, in single precision.
PackedGreens solve_all(const Factor& factor, std::span<const std::int64_t> dofs) {
  constexpr std::int64_t width = 192;
  const auto n = std::ssize(dofs);
  const std::shared_ptr<float[]> packed(new float[static_cast<std::size_t>(packed_size(n))]);
  const SelectedSolver solver(factor);
  std::vector<SelectedSolver::Workspace> workspaces(static_cast<std::size_t>(processors()));
  parallel_for((n + width - 1) / width, processors(), [&](std::int64_t block, int worker) {
    const std::int64_t first = block * width, count = std::min(width, n - first);
    std::vector<double> columns(static_cast<std::size_t>((n - first) * count));
    solver.solve(dofs.subspan(static_cast<std::size_t>(first)),
                 dofs.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count)),
                 workspaces[static_cast<std::size_t>(worker)], columns);
    for (std::int64_t j = 0; j < count; ++j) {
      for (std::int64_t i = j; i < n - first; ++i)
        packed[packed_index(first + i, first + j, n)] =
            static_cast<float>(columns[static_cast<std::size_t>(i * count + j)]);
    }
  });
  return {std::shared_ptr<const void>(packed, packed.get()), n, Precision::single_precision};
}

Forms make_forms(const StiffnessInput& body, const Surface& surface) {
  const Stiffness stiffness = assemble_stiffness(body);
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  const test::ClusteredBody stored(body.mesh, stiffness,
                                   stored_dof_marks(body.mesh, surface, stiffness, Scope::surface, 0), {});
  ThreadSharing threads(processors());
  Compression compression(factor, stored.dofs, body.mesh.dimension(), stored.clusters, threads,
                          std::int64_t{1} << 30, [](CompressionStage, double) { return true; });
  compression.prepare();
  std::shared_ptr<const HierarchicalMatrix> matrix = compression.compress(4e-4);
  Forms forms;
  forms.points = stored.points;
  forms.compressed_bytes = matrix->bytes();
  forms.dense_bytes = 4 * matrix->order() * matrix->order();
  forms.compressed = make_greens(std::move(matrix));
  forms.dense = make_greens(solve_all(factor, stored.dofs), body.mesh.dimension());
  return forms;
}

Forms forms_of(const std::filesystem::path& model_toml) {
  const Description description = read_description(model_toml);
  const MeshedBody body = mesh_body(description, [](const std::string&) {});
  std::vector<Material> materials;
  for (const MaterialPart& part : description.materials) materials.push_back(part.material);
  return make_forms({body.mesh, description.analysis, description.thickness, materials,
                     body.material_of_element, body.fixed, body.prescribed},
                    body.surface);
}

Forms forms_of_block() {
  const test::ElasticCase block =
      test::ElasticCase(generate(BoxShape{.size = Vec3(0.125, 0.155, 0.155), .cells = {25, 31, 31}}),
                        {.youngs_modulus = 1e4, .poissons_ratio = 0.45})
          .hold([](const Vec3& x) { return x.x() < 1e-9; }, 7);
  return make_forms(block.body(), extract_surface(block.mesh));
}

enum class Place { together, everywhere };

/// So many nodes, another set at each call: those nearest to a node, or any.
class Touches {
 public:
  Touches(const Forms& forms, Index count, Place place) {
    std::mt19937 random(3);
    std::vector<Index> nodes(forms.points.size());
    std::iota(nodes.begin(), nodes.end(), 0);
    for (int k = 0; k < 64; ++k) {
      std::shuffle(nodes.begin(), nodes.end(), random);
      if (place == Place::together) {
        const Vec3 centre = forms.points[static_cast<std::size_t>(nodes.front())];
        const auto distance = [&](Index node) {
          return (forms.points[static_cast<std::size_t>(node)] - centre).squaredNorm();
        };
        std::partial_sort(nodes.begin(), nodes.begin() + count, nodes.end(),
                          [&](Index a, Index b) { return distance(a) < distance(b); });
      }
      sets_.emplace_back(nodes.begin(), nodes.begin() + count);
    }
  }
  const std::vector<Index>& next() { return sets_[next_++ % sets_.size()]; }

 private:
  std::vector<std::vector<Index>> sets_;
  std::size_t next_ = 0;
};

/// A block row: the first node's blocks at all of them.
void row(benchmark::State& run, const Forms& forms, const Greens& greens, Index count, Place place) {
  Touches touches(forms, count, place);
  const auto d = static_cast<std::size_t>(greens.dimension());
  std::vector<double> blocks(d * d * static_cast<std::size_t>(count));
  for (auto _ : run) {  // NOLINT(clang-analyzer-deadcode.DeadStores)
    const std::vector<Index>& nodes = touches.next();
    greens.gather(nodes.front(), nodes, blocks);
    benchmark::DoNotOptimize(blocks.data());
    benchmark::ClobberMemory();
  }
}

/// Displacement of `length` nodes, or all where it is 0, by `count` nodes. A run of 64 is what a tick has
/// time for.
void displace(benchmark::State& run, const Forms& forms, const Greens& greens, Index count, Place place,
              Index length) {
  Touches touches(forms, count, place);
  const auto d = static_cast<std::size_t>(greens.dimension());
  const std::vector<double> f(d * static_cast<std::size_t>(count), 0.01);
  const Index nodes = length == 0 ? greens.nodes() : length;
  std::vector<double> u(d * static_cast<std::size_t>(nodes));
  Index first = 0;
  for (auto _ : run) {  // NOLINT(clang-analyzer-deadcode.DeadStores)
    greens.displacement(touches.next(), f, first, u);
    benchmark::DoNotOptimize(u.data());
    benchmark::ClobberMemory();
    first = length == 0 || first + 2 * length > greens.nodes() ? 0 : first + length;
  }
}

/// A tool that moves: N nodes in contact, and one that comes.
struct Arrival {
  Index node;
  std::vector<Index> contacts;  ///< the node itself is the last
};

/// Nodes in the order of their distance from places of the body, so many of each place.
std::vector<std::vector<Index>> neighbourhoods(const std::vector<Vec3>& points, std::size_t size) {
  constexpr std::size_t places = 200;
  std::mt19937 random(5);
  std::uniform_int_distribution<std::size_t> any(0, points.size() - 1);
  std::vector<std::vector<Index>> all(places, std::vector<Index>(points.size()));
  for (std::vector<Index>& nodes : all) {
    const Vec3 centre = points[any(random)];
    std::iota(nodes.begin(), nodes.end(), 0);
    const auto distance = [&](Index node) {
      return (points[static_cast<std::size_t>(node)] - centre).squaredNorm();
    };
    std::partial_sort(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(size), nodes.end(),
                      [&](Index a, Index b) { return distance(a) < distance(b); });
    nodes.resize(size);
    nodes.shrink_to_fit();
  }
  return all;
}

/// At each place the next nodes come one after another.
std::vector<Arrival> arrivals_at(const std::vector<Vec3>& points, std::size_t contacts) {
  constexpr std::size_t steps = 30;
  std::vector<Arrival> arrivals;
  for (const std::vector<Index>& nodes : neighbourhoods(points, contacts + steps)) {
    for (std::size_t k = 0; k < steps; ++k) {
      const auto first = nodes.begin() + static_cast<std::ptrdiff_t>(k);
      const auto end = first + static_cast<std::ptrdiff_t>(contacts) + 1;
      arrivals.push_back({*std::prev(end), {first, end}});
    }
  }
  return arrivals;
}

/// Puts other memory into the caches.
class OtherMemory {
 public:
  void read() {
    for (std::size_t k = 0; k < bytes_.size(); k += 64) ++bytes_[k];
    benchmark::ClobberMemory();
  }

 private:
  std::vector<unsigned char> bytes_ = std::vector<unsigned char>(std::size_t{64} << 20);
};

double quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

/// Least time of each arrival, of several rounds of all.
std::vector<double> least_of_each(const std::vector<double>& took, std::size_t arrivals) {
  std::vector<double> least(took.begin(), took.begin() + static_cast<std::ptrdiff_t>(arrivals));
  for (std::size_t k = arrivals; k < took.size(); ++k)
    least[k % arrivals] = std::min(least[k % arrivals], took[k]);
  return least;
}

void new_node(benchmark::State& run, const Greens& greens, const std::vector<Arrival>& arrivals, bool cold) {
  using Clock = std::chrono::steady_clock;
  const auto d = static_cast<std::size_t>(greens.dimension());
  std::vector<double> blocks(d * d * arrivals.front().contacts.size());
  std::vector<double> took;
  OtherMemory other;
  std::size_t next = 0;
  for (auto _ : run) {  // NOLINT(clang-analyzer-deadcode.DeadStores)
    const Arrival& arrival = arrivals[next++ * (cold ? 31 : 1) % arrivals.size()];
    if (cold) other.read();
    const Clock::time_point begin = Clock::now();
    greens.gather(arrival.node, arrival.contacts, blocks);
    benchmark::DoNotOptimize(blocks.data());
    benchmark::ClobberMemory();
    took.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }
  run.counters["median"] = quantile(took, 0.5);
  run.counters["99.9%"] = quantile(took, 0.999);
  run.counters["worst"] = quantile(took, 1.0);
  if (!cold) run.counters["work_99.9%"] = quantile(least_of_each(took, arrivals.size()), 0.999);
  run.counters["nodes"] = greens.nodes();
}

void register_new_nodes(const std::filesystem::path& file) {
  const Model model = load_model(file);
  if (model.compressed == nullptr) throw Error("is not compressed", file.string(), "Give a compressed model");
  const auto greens = make_greens(model.compressed);
  std::vector<Vec3> points;
  for (const Index node : model.stored_nodes)
    points.push_back(model.mesh.nodes[static_cast<std::size_t>(node)]);
  for (const std::size_t contacts : {10, 30, 100, 200}) {
    const auto arrivals = std::make_shared<const std::vector<Arrival>>(arrivals_at(points, contacts));
    for (const bool cold : {false, true}) {
      const std::string name =
          "new_node/" + model.name + "/" + std::to_string(contacts) + (cold ? "/cold" : "/walk");
#ifndef __clang_analyzer__  // takes what the library keeps for ever for a leak
      benchmark::RegisterBenchmark(
          name.c_str(),
          [greens, arrivals, cold](benchmark::State& run) { new_node(run, *greens, *arrivals, cold); })
          ->Unit(benchmark::kMicrosecond)
          ->Iterations(cold ? 2'000 : 60'000);
#endif
    }
  }
}

void register_body(const std::string& name, Forms made) {
  const auto forms = std::make_shared<const Forms>(std::move(made));
  const auto add = [&](const std::string& title, auto function) {
    for (const bool compressed : {true, false}) {
      const std::string full = title + "/" + name + (compressed ? "/compressed" : "/dense");
#ifndef __clang_analyzer__  // takes what the library keeps for ever for a leak
      benchmark::RegisterBenchmark(full.c_str(), [forms, function, compressed](benchmark::State& run) {
        function(run, *forms, compressed ? *forms->compressed : *forms->dense);
        run.counters["nodes"] = forms->dense->nodes();
        run.counters["MB"] =
            1e-6 * static_cast<double>(compressed ? forms->compressed_bytes : forms->dense_bytes);
      })->Unit(benchmark::kMicrosecond);
#endif
    }
  };
  for (const auto& [place, where] :
       {std::pair(Place::together, "together"), {Place::everywhere, "everywhere"}}) {
    for (const Index count : {30, 200}) {
      add("row_" + std::to_string(count) + "/" + where,
          [count, place](benchmark::State& run, const Forms& of, const Greens& greens) {
            row(run, of, greens, count, place);
          });
    }
    for (const Index length : {0, 64}) {
      add((length == 0 ? "field" : "run_64") + std::string("_by_30/") + where,
          [place, length](benchmark::State& run, const Forms& of, const Greens& greens) {
            displace(run, of, greens, 30, place, length);
          });
    }
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  benchmark::Initialize(&argc, argv);
  const std::filesystem::path liver = palpate::test::source_file("meshes/models/liver");
  const char* file = std::getenv("PALPATE_BENCH_MODEL");
  if (file != nullptr && std::string(file).ends_with(".palpate.hdf")) {
    palpate::register_new_nodes(file);
  } else if (file != nullptr) {
    palpate::register_body(std::filesystem::absolute(file).parent_path().filename(), palpate::forms_of(file));
  } else {
    palpate::register_body("block", palpate::forms_of_block());
    if (std::filesystem::exists(liver / "liver.inr.gz"))
      palpate::register_body("liver", palpate::forms_of(liver / "model.toml"));
  }
  benchmark::RunSpecifiedBenchmarks();
}
