// What a tick costs. PALPATE_BENCH_MODEL=NAME.palpate.hdf measures a baked body; else blocks with
// random Green's functions stand in: the two beams that SOFA was measured on (15x7x7 and 24x10x10 cells: 1368
// and 3123 dofs) and one with 4 000 free surface nodes, as many as a fine liver has (25x31x31 cells). Nodes
// change from one iteration to the next, so that what they read is not in the near caches. Counters: median
// and 99.9 % of the iterations.
#include <benchmark/benchmark.h>
#include <cblas.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "formats/model_file.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "runtime/body/prescribed_nodes.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

/// Times of the iterations of one benchmark.
class Samples {
 public:
  template <class F>
  void time(benchmark::State& run, F&& f) {
    const Clock::time_point begin = Clock::now();
    f();
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    run.SetIterationTime(seconds);
    seconds_.push_back(seconds);
  }

  double quantile(double fraction) {
    const auto k = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(seconds_.size() - 1));
    std::nth_element(seconds_.begin(), seconds_.begin() + k, seconds_.end());
    return seconds_[static_cast<std::size_t>(k)];
  }

  void report(benchmark::State& run) {
    run.counters["median_us"] = 1e6 * quantile(0.5);
    run.counters["p99_9_us"] = 1e6 * quantile(0.999);
  }

 private:
  std::vector<double> seconds_;
};

template <class T>
PackedGreens random_greens(std::int64_t order, Precision precision) {
  auto packed = std::make_shared<std::vector<T>>(static_cast<std::size_t>(packed_size(order)));
  std::mt19937 random(1);
  std::uniform_real_distribution<float> entry(-0.01F, 0.01F);
  for (T& value : *packed) value = static_cast<T>(entry(random));
  for (std::int64_t j = 0; j < order; ++j)
    (*packed)[static_cast<std::size_t>(packed_column(j, order))] = T{1};
  return {std::shared_ptr<const void>(packed, packed->data()), order, precision};
}

/// A block of 5 mm cells whose end x = 0 is clamped, with random Green's functions of its free surface nodes.
Model random_model(const std::array<int, 3>& cells, Precision precision) {
  Model model;
  model.mesh = generate(BoxShape{.size = 0.005 * Vec3(cells[0], cells[1], cells[2]), .cells = cells});
  model.materials = {{.youngs_modulus = 1e4, .poissons_ratio = 0.45}};
  model.material_of_element.assign(static_cast<std::size_t>(model.mesh.elements()), 0);
  const Surface surface = extract_surface(model.mesh);
  model.surface = surface_simplices(surface);
  for (const Vec3& node : model.mesh.nodes) model.fixed.push_back(node.x() < 1e-9 ? 0b111 : 0);
  model.rest_force.assign(model.mesh.nodes.size(), Vec3::Zero());
  model.rest_displacement.assign(model.mesh.nodes.size(), Vec3::Zero());
  model.scope = Scope::surface;
  model.layers = 0;
  std::copy_if(surface.nodes.begin(), surface.nodes.end(), std::back_inserter(model.stored_nodes),
               [&](Index node) { return model.fixed[static_cast<std::size_t>(node)] == 0; });
  const std::int64_t order = model.stored_dofs();
  model.name = std::to_string(order) + (precision == Precision::single_precision ? "/single" : "/double");
  model.greens = precision == Precision::single_precision ? random_greens<float>(order, precision)
                                                          : random_greens<double>(order, precision);
  return model;
}

/// Different nodes at each call, through all of the body.
class NodeSource {
 public:
  explicit NodeSource(const Body& body) : nodes_(body.free_surface_nodes()) {
    std::shuffle(nodes_.begin(), nodes_.end(), std::mt19937(3));
  }
  Index next() { return nodes_[next_++ % nodes_.size()]; }

 private:
  std::vector<Index> nodes_;
  std::size_t next_ = 0;
};

void move_contacts(const Body& body, PrescribedNodes& held, NodeSource& nodes, std::int64_t contacts) {
  held.release_all();
  for (std::int64_t k = 0; k < contacts; ++k) {
    const Index node = nodes.next();
    held.hold(body, node);
    held.prescribe(node, Vec3(0.0, -0.001, -0.001));
  }
}

/// One node taken anew: gather, factor and solve.
void new_contact(benchmark::State& run, const Body& body) {
  PrescribedNodes held(body);
  NodeSource nodes(body);
  Samples samples;
  while (run.KeepRunning()) {
    samples.time(run, [&] {
      move_contacts(body, held, nodes, 1);
      benchmark::DoNotOptimize(held.solve());
    });
  }
  samples.report(run);
}

/// A held node that moves.
void held_tick(benchmark::State& run, const Body& body) {
  PrescribedNodes held(body);
  const Index node = body.free_surface_nodes().front();
  held.hold(body, node);
  Vec3 displacement = Vec3::Zero();
  Samples samples;
  while (run.KeepRunning()) {
    displacement.x() += 1e-6;
    samples.time(run, [&] {
      held.prescribe(node, displacement);
      benchmark::DoNotOptimize(held.solve());
    });
  }
  samples.report(run);
}

/// C of 30 nodes and its factor, from nothing.
void capacitance_30(benchmark::State& run, const Body& body) {
  PrescribedNodes held(body);
  NodeSource nodes(body);
  Samples samples;
  while (run.KeepRunning()) {
    samples.time(run, [&] { move_contacts(body, held, nodes, 30); });
  }
  samples.report(run);
}

/// Contacts moved to new nodes: gather, factor, forces and the displacement of all stored nodes.
void moved_contacts(benchmark::State& run, const Body& body, std::int64_t contacts) {
  PrescribedNodes held(body);
  NodeSource nodes(body);
  std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
  Samples samples;
  while (run.KeepRunning()) {
    samples.time(run, [&] {
      move_contacts(body, held, nodes, contacts);
      held.solve();
      held.displace(body, u);
      benchmark::DoNotOptimize(u.data());
    });
  }
  samples.report(run);
}

/// The displacement alone, with the rate at which it reads its rows.
void displacement(benchmark::State& run, const Body& body, std::int64_t contacts) {
  NodeSource nodes(body);
  std::vector<Index> held(static_cast<std::size_t>(contacts));
  const std::vector<double> f(static_cast<std::size_t>(body.dimension()) * held.size(), 1.0);
  std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
  Samples samples;
  while (run.KeepRunning()) {
    for (Index& node : held) node = nodes.next();
    samples.time(run, [&] {
      body.greens().displacement(held, f, u);
      benchmark::DoNotOptimize(u.data());
    });
  }
  samples.report(run);
  const std::int64_t bytes =
      body.dimension() * contacts * body.greens().order() * bytes_per_scalar(body.greens().precision());
  run.counters["GB_per_s"] = 1e-9 * static_cast<double>(bytes) / samples.quantile(0.5);
}

/// The same displacement as a product with the whole packed inverse.
void packed_product(benchmark::State& run, const PackedGreens& greens) {
  const auto n = static_cast<int>(greens.order());
  const std::vector<float> f_single(static_cast<std::size_t>(n), 1.0F);
  const std::vector<double> f_double(static_cast<std::size_t>(n), 1.0);
  std::vector<float> u_single(f_single.size());
  std::vector<double> u_double(f_double.size());
  Samples samples;
  while (run.KeepRunning()) {
    samples.time(run, [&] {
      if (greens.precision() == Precision::single_precision) {
        cblas_sspmv(CblasColMajor, CblasLower, n, 1.0F, greens.as<float>().data(), f_single.data(), 1, 0.0F,
                    u_single.data(), 1);
      } else {
        cblas_dspmv(CblasColMajor, CblasLower, n, 1.0, greens.as<double>().data(), f_double.data(), 1, 0.0,
                    u_double.data(), 1);
      }
    });
  }
  samples.report(run);
}

/// How fast one processor reads memory, from a block as large as the square of that many dofs.
void read_bandwidth(benchmark::State& run, std::int64_t order) {
  const std::vector<std::uint64_t> block(static_cast<std::size_t>(order * order / 2), 1);
  Samples samples;
  while (run.KeepRunning()) {
    samples.time(run, [&] {
      benchmark::DoNotOptimize(std::accumulate(block.begin(), block.end(), std::uint64_t{0}));
    });
  }
  samples.report(run);
  run.counters["GB_per_s"] = 8e-9 * static_cast<double>(block.size()) / samples.quantile(0.5);
}

/// Packed to square.
void unfold(benchmark::State& run, const PackedGreens& greens, int dimension) {
  Samples samples;
  while (run.KeepRunning())
    samples.time(run, [&] { benchmark::DoNotOptimize(make_greens(greens, dimension)->order()); });
  samples.report(run);
  run.counters["GB_per_s"] =
      1e-9 * static_cast<double>(greens.order() * greens.order() * bytes_per_scalar(greens.precision())) /
      samples.quantile(0.5);
}

void register_body(Model model) {
  const PackedGreens packed = model.greens;
  const auto body = std::make_shared<const Body>(std::move(model));
  const std::string name = "/" + body->model().name;
  const auto add = [](const std::string& title, auto&& function) {
#ifndef __clang_analyzer__  // takes what the library keeps for ever for a leak
    benchmark::RegisterBenchmark(title.c_str(), function)
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond)
        ->MinTime(0.3);
#endif
  };
  add("new_contact" + name, [body](benchmark::State& run) { new_contact(run, *body); });
  add("held_tick" + name, [body](benchmark::State& run) { held_tick(run, *body); });
  add("capacitance_30" + name, [body](benchmark::State& run) { capacitance_30(run, *body); });
  for (const std::int64_t contacts : {1, 10, 30}) {
    const std::string title = name + "/contacts:" + std::to_string(contacts);
    add("moved_contacts" + title,
        [body, contacts](benchmark::State& run) { moved_contacts(run, *body, contacts); });
    add("displacement" + title,
        [body, contacts](benchmark::State& run) { displacement(run, *body, contacts); });
  }
  add("packed_product" + name, [packed](benchmark::State& run) { packed_product(run, packed); });
  add("read_bandwidth" + name,
      [body](benchmark::State& run) { read_bandwidth(run, body->greens().order()); });
  add("unfold" + name, [body, packed](benchmark::State& run) { unfold(run, packed, body->dimension()); });
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  benchmark::Initialize(&argc, argv);
  if (const char* file = std::getenv("PALPATE_BENCH_MODEL")) {
    palpate::register_body(palpate::load_model(file));
  } else {
    for (const std::array<int, 3> cells : {std::array{15, 7, 7}, {24, 10, 10}, {25, 31, 31}}) {
      palpate::register_body(palpate::random_model(cells, palpate::Precision::single_precision));
    }
    palpate::register_body(palpate::random_model({24, 10, 10}, palpate::Precision::double_precision));
  }
  benchmark::RunSpecifiedBenchmarks();
}
