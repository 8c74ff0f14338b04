// Speed of the precomputation: columns of Xi against a plain cholmod_solve2, and whole bakes.
//
//   precompute_bench [--benchmark_filter=...]
//
// The liver needs meshes/models/liver/liver.inr.gz (scripts/demo and scripts/test put it there).
#include <benchmark/benchmark.h>
#include <cblas.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <thread>

#include "meshes/surface.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/greens_solver.h"
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/scope.h"
#include "tests/support/folders.h"

namespace palpate {
namespace {

constexpr std::int64_t block_columns = 192;

std::filesystem::path model_toml(const std::string& name) {
  return palpate::test::source_file("meshes/models/" + name + "/model.toml");
}

template <class F>
double seconds(F f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// A factorised body with its solver.
struct Prepared {
  MeshedBody body;
  Stiffness stiffness;
  Factor factor;
  GreensSolver solver;

  Prepared(MeshedBody meshed, const Description& description)
      : body(std::move(meshed)),
        stiffness(assemble_stiffness({body.mesh,
                                      description.analysis,
                                      description.thickness,
                                      {&description.materials.at(0).material, 1},
                                      body.material_of_element,
                                      body.fixed,
                                      body.prescribed})),
        factor(stiffness.K, stiffness.node_start),
        solver(factor, stored_dof_marks(body.mesh, body.surface, stiffness, Scope::surface, 0),
               stiffness.free_dofs, 3) {
    factor.factorize();
  }
};

/// The liver with the given edge length at its surface [m]; kept for the next benchmark of the run.
const Prepared& liver(double edge_length) {
  static std::map<double, std::unique_ptr<Prepared>> kept;
  std::unique_ptr<Prepared>& prepared = kept[edge_length];
  if (!prepared) {
    Description description = read_description(model_toml("liver"));
    description.mesh.edge_length = edge_length;
    prepared = std::make_unique<Prepared>(mesh_body(description, [](const std::string&) {}), description);
  }
  return *prepared;
}

/// Reference: cholmod_solve2 with kept workspace on 192 right-hand sides, all rows computed.
class PlainSolve {
 public:
  explicit PlainSolve(const Prepared& prepared)
      : factor_(prepared.factor),
        dofs_(prepared.solver.stored_dofs()),
        rhs_(static_cast<std::size_t>(factor_.order() * block_columns)) {}
  ~PlainSolve() {
    cholmod_common& common = factor_.common();
    cholmod_l_free_dense(&x_, &common);
    cholmod_l_free_dense(&y_, &common);
    cholmod_l_free_dense(&e_, &common);
  }
  PlainSolve(const PlainSolve&) = delete;
  PlainSolve& operator=(const PlainSolve&) = delete;

  void operator()(std::int64_t first) {
    std::fill(rhs_.begin(), rhs_.end(), 0.0);
    for (std::int64_t c = 0; c < block_columns; ++c) {
      rhs_[static_cast<std::size_t>(c * factor_.order() + dofs_[static_cast<std::size_t>(first + c)])] = 1.0;
    }
    cholmod_dense b{};
    b.nrow = b.d = static_cast<std::size_t>(factor_.order());
    b.ncol = block_columns;
    b.nzmax = rhs_.size();
    b.x = rhs_.data();
    b.xtype = CHOLMOD_REAL;
    b.dtype = CHOLMOD_DOUBLE;
    auto* L = const_cast<cholmod_factor*>(&factor_.supernodal());  // cholmod_solve2 reads it only
    cholmod_l_solve2(CHOLMOD_A, L, &b, nullptr, &x_, nullptr, &y_, &e_, &factor_.common());
  }

 private:
  const Factor& factor_;
  std::vector<std::int64_t> dofs_;
  std::vector<double> rhs_;
  cholmod_dense *x_ = nullptr, *y_ = nullptr, *e_ = nullptr;
};

/// Blocks spread evenly over all columns, ours and the reference in turn, one BLAS thread, one job.
void liver_columns(benchmark::State& state, double edge_length, int samples) {
  const Prepared& prepared = liver(edge_length);
  openblas_set_num_threads(1);
  const std::int64_t n = prepared.solver.order(), blocks = n / block_columns;
  GreensSolver::Workspace workspace;
  std::vector<double> packed, ours, plain;
  PlainSolve solve(prepared);
  solve(0);
  double spent = 0.0;
  for (auto _ : state) {  // NOLINT(clang-analyzer-deadcode.DeadStores)
    for (int sample = 0; sample < samples; ++sample) {
      const std::int64_t first =
          (std::int64_t{2} * sample + 1) * blocks / (std::int64_t{2} * samples) * block_columns;
      ours.push_back(seconds([&] { prepared.solver.columns(first, block_columns, workspace, packed); }) /
                     block_columns);
      plain.push_back(seconds([&] { solve(first); }) / block_columns);
      spent += ours.back();
    }
  }
  const double mean = spent / static_cast<double>(ours.size());
  state.counters["surface_nodes"] = static_cast<double>(prepared.body.surface.nodes.size());
  state.counters["nodes"] = static_cast<double>(prepared.body.mesh.nodes.size());
  state.counters["factor_entries"] = static_cast<double>(prepared.factor.entries());
  state.counters["columns"] = static_cast<double>(n);
  state.counters["ms_per_column"] = 1e3 * mean;
  state.counters["ms_cholmod_solve2"] = 1e3 * median(plain);
  state.counters["times_faster"] = median(plain) / mean;
}

/// What a tick of the runtime would cost without Green's functions: a new node's three columns by a solve
/// with the factor, then the 3 x 3 system. The whole displacement comes with it.
void tick_by_sparse_solve(benchmark::State& state) {
  const Prepared& prepared = liver(read_description(model_toml("liver")).mesh.edge_length.value());
  openblas_set_num_threads(1);
  const std::vector<std::int64_t> dofs = prepared.solver.stored_dofs();
  const std::int64_t n = prepared.factor.order();
  std::vector<double> rhs(static_cast<std::size_t>(3 * n));
  std::size_t node = 0;
  for (auto _ : state) {                 // NOLINT(clang-analyzer-deadcode.DeadStores)
    node = (node + 2991) % dofs.size();  // a multiple of 3, as dofs.size() is
    std::fill(rhs.begin(), rhs.end(), 0.0);
    for (std::int64_t axis = 0; axis < 3; ++axis)
      rhs[static_cast<std::size_t>(axis * n + dofs[node] + axis)] = 1.0;
    const std::vector<double> Xi = prepared.factor.solve(rhs, 3);
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> columns(Xi.data(), n, 3);
    const Vec3 f = columns.middleRows<3>(dofs[node]).llt().solve(Vec3(0.0, 0.0, 1e-3));
    benchmark::DoNotOptimize(Eigen::VectorXd(columns * f));
  }
}

/// A whole bake, file included, with all processors.
void whole_bake(benchmark::State& state, const std::string& name) {
  const Description description = read_description(model_toml(name));
  BakeOptions options;
  options.output = std::filesystem::temp_directory_path() / (name + "-bench.palpate.hdf");
  options.jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  for (auto _ : state)  // NOLINT(clang-analyzer-deadcode.DeadStores)
    bake(description, options);
  state.counters["file_MB"] = static_cast<double>(std::filesystem::file_size(options.output)) * 1e-6;
  state.counters["jobs"] = options.jobs;
  std::filesystem::remove(options.output);
}

BENCHMARK_CAPTURE(whole_bake, beam15, "beam15")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(whole_bake, beam24, "beam24")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(tick_by_sparse_solve)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(liver_columns, as_in_model_toml,
                  read_description(model_toml("liver")).mesh.edge_length.value(), 16)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(liver_columns, about_20000_surface_nodes, 0.0024, 6)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace palpate

BENCHMARK_MAIN();
