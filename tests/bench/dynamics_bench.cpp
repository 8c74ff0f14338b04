// What it costs that a body swings.
//
// product: the packed product against reading. Rounds of products and of plain reading of the same block with
// as many threads alternate. Counters: medians of the bytes of the packed triangle over the
// time of a product, of the machine's reading (the fastest of several loops), and of their ratio round by
// round.
//
// step: a whole Newmark step. packed: K_bar^-1 has the right size but made-up entries, M and C_d are the
// body's. sparse: the same step with K_bar^-1 f_bar by a CHOLMOD solve with the factor of K_bar, one
// thread. modal: in modal coordinates; modal_seen: and the displacement of all nodes of the surface.
// Counters: steps a second by the median, free nodes and dofs, MB that a step reads (sparse: of the factor),
// nodes of the surface.
//
// largest: the most free nodes whose packed step takes at most 1/60 s or 1 ms, by bisection.
//
// tick: of a sphere that slides at 50 mm/s, 3 mm deep, over a body at rest (`still`: of a file without
// dynamics) and one that swings without damping because it was let go before, with quasi-static and with
// dynamic contact. Ticks of all three alternate. Counters: median and 99.9 %; how far the surface swings.
//
// Bodies: boxes of soft tissue, 100 mm long, of tet4, clamped below. PALPATE_BENCH_MODEL=NAME.palpate.hdf
// takes another one for sparse, modal and tick; it needs modal dynamics.
#include <benchmark/benchmark.h>
#include <cblas.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "formats/model_file.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/dynamics.h"
#include "runtime/body/body.h"
#include "runtime/body/packed_newmark.h"
#include "runtime/core/body/modal_newmark.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/make_dynamics.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int slide_ticks = 20000;
constexpr int rounds = 15;  // of products and reading
const std::vector<int> usual_nodes = {500, 1000, 2000, 4000};

template <class F>
double seconds(F&& f) {
  const Clock::time_point begin = Clock::now();
  f();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double quantile(std::vector<double> values, double fraction) {
  const auto k = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

double median(const std::vector<double>& values) {
  return quantile(values, 0.5);
}

template <class T>
PackedGreens made_up_matrix(std::int64_t order, Precision precision, double size) {
  auto packed = std::make_shared<std::vector<T>>(static_cast<std::size_t>(packed_size(order)));
  std::uint64_t number = 1;
  for (T& value : *packed) {
    number = number * 6364136223846793005U + 1442695040888963407U;
    value = static_cast<T>(size * (1.0 + 0x1p-53 * static_cast<double>(number >> 11U)));
  }
  return {std::shared_ptr<const void>(packed, packed->data()), order, precision};
}

PackedGreens made_up_matrix(std::int64_t order, Precision precision, double size) {
  return precision == Precision::single_precision ? made_up_matrix<float>(order, precision, size)
                                                  : made_up_matrix<double>(order, precision, size);
}

double bytes_of(const PackedGreens& matrix) {
  return static_cast<double>(packed_size(matrix.order()) * bytes_per_scalar(matrix.precision()));
}

/// The sum of a block, in `streams` places at once, with so many sums in each.
template <int sums, int streams>
double sum_of(std::span<const double> block) {
  using Sums = Eigen::Array<double, sums, 1>;
  const std::size_t length = block.size() / streams / sums * sums;
  std::array<Sums, streams> total;
  total.fill(Sums::Zero());
  for (std::size_t i = 0; i < length; i += sums) {
    for (std::size_t s = 0; s < streams; ++s)
      total[s] += Eigen::Map<const Sums>(block.data() + s * length + i);
  }
  for (std::size_t s = 1; s < streams; ++s) total[0] += total[s];
  return total[0].sum();
}

using Sum = double (*)(std::span<const double>);
const std::vector<Sum> sums = {sum_of<32, 1>, sum_of<64, 1>, sum_of<32, 2>, sum_of<16, 4>, sum_of<8, 8>};

/// Bytes a second at which `jobs` threads read their parts of a block, again and again for a while.
double reading_rate(std::span<const double> block, int jobs, Sum sum) {
  constexpr double enough = 2e8;  // bytes
  const std::size_t part = block.size() / static_cast<std::size_t>(jobs);
  const double bytes = 8.0 * static_cast<double>(part) * jobs;
  const int passes = std::max(1, static_cast<int>(enough / bytes));
  const auto read = [&](int job) {
    const std::span<const double> mine(block.data() + static_cast<std::size_t>(job) * part, part);
    for (int pass = 0; pass < passes; ++pass) {
      benchmark::ClobberMemory();
      benchmark::DoNotOptimize(sum(mine));
    }
  };
  return bytes * passes / seconds([&] {
           std::vector<std::jthread> helpers;
           for (int job = 1; job < jobs; ++job) helpers.emplace_back(read, job);
           read(0);
         });
}

void time_product(benchmark::State& run, std::int64_t order, Precision precision, int jobs) {
  const PackedGreens matrix = made_up_matrix(order, precision, 1.0);
  const double bytes = bytes_of(matrix);
  const std::span<const double> block(static_cast<const double*>(matrix.data()),
                                      static_cast<std::size_t>(bytes / 8.0));
  const std::vector<double> x(static_cast<std::size_t>(order), 1.0);
  std::vector<double> y(x.size());
  PackedProduct product(matrix, jobs);
  const int products = std::clamp(static_cast<int>(1e8 / bytes), 3, 50);  // in a round
  std::vector<double> times, rates, readings, ratios;
  while (run.KeepRunning()) {
    double reading = 0.0;
    for (const Sum sum : sums) reading = std::max(reading, reading_rate(block, jobs, sum));
    readings.push_back(reading);
    times.clear();
    product.multiply(x, y);
    for (int k = 0; k < products; ++k) times.push_back(seconds([&] { product.multiply(x, y); }));
    benchmark::DoNotOptimize(y.data());
    rates.push_back(bytes / median(times));
    ratios.push_back(rates.back() / reading);
    run.SetIterationTime(median(times));
  }
  run.counters["GB_per_s"] = 1e-9 * median(rates);
  run.counters["reading_GB_per_s"] = 1e-9 * median(readings);
  run.counters["ratio"] = median(ratios);
  run.counters["MB"] = 1e-6 * bytes;
}

/// What a step needs of a body besides K_bar^-1.
struct Matrices {
  Stiffness stiffness;
  SparseMatrix M;
  SparseMatrix K_bar;
  Rayleigh damping;
  Newmark newmark;

  explicit Matrices(const Model& model) : stiffness(assemble_stiffness(stiffness_input(model))) {
    constexpr double hertz = 2.0 * M_PI;
    damping = rayleigh_damping(2.0 * hertz, 0.05, 20.0 * hertz, 0.05);
    M = assemble_mass(stiffness_input(model), stiffness, false);
    K_bar = effective_stiffness(stiffness.K, M, damping, newmark);
  }
};

/// A box of nodes[0] x nodes[1] x nodes[2] free nodes, clamped below, all of which is kept.
Model box(const std::array<int, 3>& nodes) {
  Model model;
  model.name = "box";
  const std::array<int, 3> cells = {nodes[0] - 1, nodes[1] - 1, nodes[2]};
  const double edge = 0.1 / *std::max_element(cells.begin(), cells.end());
  model.mesh = generate(BoxShape{.size = edge * Vec3(cells[0], cells[1], cells[2]), .cells = cells});
  model.materials = {{.youngs_modulus = 5.5e3, .poissons_ratio = 0.45, .density = 1060.0}};
  model.material_of_element.assign(static_cast<std::size_t>(model.mesh.elements()), 0);
  for (const Vec3& node : model.mesh.nodes) model.fixed.push_back(node.z() < 1e-9 ? 0b111 : 0);
  model.surface = surface_simplices(extract_surface(model.mesh));
  model.scope = Scope::full;
  for (Index node = 0; node < std::ssize(model.mesh.nodes); ++node) {
    if (model.fixed[static_cast<std::size_t>(node)] == 0) model.stored_nodes.push_back(node);
  }
  return model;
}

Model box(int free_nodes) {
  if (free_nodes == 500) return box({10, 10, 5});
  return box(
      {free_nodes > 1000 ? 20 : 10, free_nodes > 2000 ? 20 : 10, free_nodes > 2000 ? free_nodes / 400 : 10});
}

/// Times steps one by one and reports.
class Steps {
 public:
  template <class F>
  void time(benchmark::State& run, F&& f) {
    f();
    while (run.KeepRunning()) {
      times_.push_back(seconds(f));
      run.SetIterationTime(times_.back());
    }
    run.counters["steps_per_s"] = 1.0 / median(times_);
  }

 private:
  std::vector<double> times_;
};

/// Packed dynamics with an inverse so small that motion neither grows nor ends.
StoredDynamics made_up_dynamics(const Model& model, Precision precision) {
  const Matrices matrices(model);
  StoredDynamics dynamics;
  dynamics.method = DynamicsMethod::packed;
  dynamics.damping = matrices.damping;
  dynamics.newmark = matrices.newmark;
  dynamics.matrices = mass_and_damping(matrices.stiffness.K, matrices.M, matrices.damping,
                                       stored_dofs_of(model, matrices.stiffness));
  dynamics.inverse = made_up_matrix(model.stored_dofs(), precision, 1e-12);
  return dynamics;
}

/// A step that moves.
void push(PackedNewmark& newmark) {
  newmark.predict();
  newmark.advance(std::vector<double>(newmark.u().size(), 0.001), {});
}

void time_packed(benchmark::State& run, int free_nodes, Precision precision, int jobs) {
  const StoredDynamics dynamics = made_up_dynamics(box(free_nodes), precision);
  PackedNewmark newmark(dynamics, jobs);
  push(newmark);
  Steps().time(run, [&] {
    newmark.predict();
    newmark.advance();
  });
  run.counters["free_nodes"] = free_nodes;
  run.counters["MB"] = 1e-6 * bytes_of(dynamics.inverse);
}

/// Newmark's method with a sparse solve in each step.
class SparseNewmark {
 public:
  explicit SparseNewmark(const Model& model)
      : matrices_(model), factor_(matrices_.K_bar, matrices_.stiffness.node_start) {
    factor_.factorize();
    for (Eigen::VectorXd* of_dofs : {&u_, &v_, &a_, &with_M_, &with_K_, &f_bar_})
      of_dofs->setConstant(factor_.order(), 0.001);
  }
  ~SparseNewmark() {
    cholmod_l_free_dense(&x_, &factor_.common());
    cholmod_l_free_dense(&y_, &factor_.common());
    cholmod_l_free_dense(&e_, &factor_.common());
  }
  SparseNewmark(const SparseNewmark&) = delete;
  SparseNewmark& operator=(const SparseNewmark&) = delete;

  void step() {
    const Newmark& h = matrices_.newmark;
    with_K_ = h.a1() * u_ + h.a4() * v_ + h.a5() * a_;  // C_d = a M + b K
    with_M_ = h.a0() * u_ + h.a2() * v_ + h.a3() * a_ + matrices_.damping.mass * with_K_;
    f_bar_.noalias() = matrices_.M.selfadjointView<Eigen::Lower>() * with_M_;
    with_K_ *= matrices_.damping.stiffness;
    f_bar_.noalias() += matrices_.stiffness.K.selfadjointView<Eigen::Lower>() * with_K_;
    solve();
    const Eigen::Map<const Eigen::VectorXd> u(static_cast<const double*>(x_->x), u_.size());
    with_M_ = h.a0() * (u - u_) - h.a2() * v_ - h.a3() * a_;
    v_ += h.time_step * ((1.0 - h.delta) * a_ + h.delta * with_M_);
    a_ = with_M_;
    u_ = u;
  }

  /// So that motion does not end in numbers that processors are slow with.
  void push() { u_.setConstant(0.001); }
  [[nodiscard]] const Factor& factor() const noexcept { return factor_; }

 private:
  void solve() {
    cholmod_dense b{};
    b.nrow = b.d = b.nzmax = static_cast<std::size_t>(f_bar_.size());
    b.ncol = 1;
    b.x = f_bar_.data();
    b.xtype = CHOLMOD_REAL;
    b.dtype = CHOLMOD_DOUBLE;
    auto* L = const_cast<cholmod_factor*>(&factor_.supernodal());  // cholmod_solve2 reads it only
    cholmod_l_solve2(CHOLMOD_A, L, &b, nullptr, &x_, nullptr, &y_, &e_, &factor_.common());
  }

  Matrices matrices_;
  Factor factor_;
  Eigen::VectorXd u_, v_, a_, with_M_, with_K_, f_bar_;
  cholmod_dense* x_ = nullptr;
  cholmod_dense* y_ = nullptr;
  cholmod_dense* e_ = nullptr;
};

void time_sparse(benchmark::State& run, const Model& model) {
  SparseNewmark newmark(model);
  std::int64_t steps = 0;
  Steps().time(run, [&] {
    if (++steps % 100 == 0) newmark.push();
    newmark.step();
  });
  run.counters["free_nodes"] = static_cast<double>(newmark.factor().order()) / 3.0;
  run.counters["MB"] = 8e-6 * static_cast<double>(newmark.factor().entries());
}

/// Stored nodes on the surface.
std::vector<Index> surface_nodes(const Model& model) {
  std::vector<bool> on_surface(model.mesh.nodes.size());
  for (const Index node : model.surface) on_surface[static_cast<std::size_t>(node)] = true;
  std::vector<Index> nodes;
  for (Index stored = 0; stored < std::ssize(model.stored_nodes); ++stored) {
    if (on_surface[static_cast<std::size_t>(model.stored_nodes[static_cast<std::size_t>(stored)])])
      nodes.push_back(stored);
  }
  return nodes;
}

void keep_modes(Model& model, Index count) {
  model.dynamics.omega.resize(static_cast<std::size_t>(count) + 1);
  model.dynamics.shapes.resize(static_cast<std::size_t>(count * model.stored_dofs()));
}

/// Modal steps with, if `seen`, the displacement of the surface.
void time_modal(benchmark::State& run, Model model, Index count, bool seen) {
  if (model.dynamics.modes() < count) return run.SkipWithError("the file has fewer modes");
  keep_modes(model, count);
  const Modes modes(model.dimension(), model.dynamics.omega, model.dynamics.shapes);
  const std::vector<Index> nodes = surface_nodes(model);
  std::vector<Vec3> u(nodes.size());
  const std::vector<double> g(static_cast<std::size_t>(count), 1.0), rate(g.size());
  ModalNewmark newmark(modes.omega(), {}, model.dynamics.newmark);
  newmark.let_go(g, rate);
  Steps().time(run, [&] {
    newmark.predict();
    newmark.advance(g);
    if (!seen) return;
    for (std::size_t k = 0; k < nodes.size(); ++k) u[k] = modes.displacement(nodes[k], newmark.q());
    benchmark::DoNotOptimize(u.data());
  });
  run.counters["free_nodes"] = static_cast<double>(model.stored_nodes.size());
  if (seen) run.counters["surface_nodes"] = static_cast<double>(nodes.size());
}

/// The box with its lowest modes; those of the last box are kept.
const Model& box_with_modes(int free_nodes) {
  static Model model;
  static int nodes = 0;
  if (nodes == free_nodes) return model;
  nodes = free_nodes;
  model = box(free_nodes);
  DynamicsOptions options;
  options.method = DynamicsMethod::modal;
  options.modes = 200;
  model.dynamics = test::make_dynamics(model, options, Precision::single_precision);
  return model;
}

double packed_step_seconds(const Model& model, Precision precision) {
  const StoredDynamics dynamics = made_up_dynamics(model, precision);
  PackedNewmark newmark(dynamics, 1);
  push(newmark);
  constexpr int repetitions = 15;
  std::vector<double> times;
  times.reserve(repetitions);
  for (int k = 0; k < repetitions; ++k) {
    times.push_back(seconds([&] {
      newmark.predict();
      newmark.advance();
    }));
  }
  return median(times);
}

/// Boxes of 10 x 10 x layers nodes.
void find_largest(benchmark::State& run, Precision precision, double most_seconds) {
  int fits = 1, too_many = 128;
  while (run.KeepRunning()) {
    while (too_many - fits > 1) {
      const int layers = (fits + too_many) / 2;
      (packed_step_seconds(box({10, 10, layers}), precision) <= most_seconds ? fits : too_many) = layers;
    }
  }
  run.counters["free_nodes"] = 100.0 * fits;
  run.counters["free_dofs"] = 300.0 * fits;
}

/// A sphere that presses a body, grabs it, drags it aside and lets go; then it slides to and fro.
std::vector<ToolPose> tick_poses(const Vec3& top, double radius) {
  constexpr double depth = 0.003, dragged = 0.008, way = 0.01, speed = 0.05, above = 0.03;
  std::vector<ToolPose> poses;
  const auto add = [&](const Vec3& offset, bool grab) {
    ToolPose pose;
    pose.position = top + radius * Vec3::UnitZ() + offset;
    pose.grab = grab;
    poses.push_back(pose);
  };
  for (int k = 0; k <= 300; ++k) add((above - (above + depth) * k / 300.0) * Vec3::UnitZ(), false);
  for (int k = 0; k <= 300; ++k) add(-depth * Vec3::UnitZ() + dragged * k / 300.0 * Vec3::UnitX(), true);
  for (int k = 0; k <= 300; ++k) add((above * k / 300.0 - depth) * Vec3::UnitZ(), false);
  for (int k = 0; k <= 300; ++k) add((above - (above + depth) * k / 300.0) * Vec3::UnitZ(), false);
  const double period = 2.0 * way / speed;
  for (int k = 0; k < slide_ticks; ++k) {
    const double phase = std::fmod(0.001 * k / period + 0.25, 1.0);
    add(-depth * Vec3::UnitZ() + way * (0.5 - std::abs(2.0 * phase - 1.0)) * Vec3::UnitX(), false);
  }
  return poses;
}

/// The free surface node that is highest, nearest to the middle.
Index top_node(const Body& body) {
  const Vec3 middle = body.bounds().center();
  const auto badness = [&](Index node) {
    const Vec3 x = body.rest_position(node);
    return std::pair(-std::round(1e6 * x.z()), (x - middle).squaredNorm());
  };
  return *std::min_element(body.free_surface_nodes().begin(), body.free_surface_nodes().end(),
                           [&](Index a, Index b) { return badness(a) < badness(b); });
}

/// One of the bodies whose ticks are compared.
struct Touched {
  Body body;
  State state;
  std::vector<double> times;
  double contacts = 0.0, swing = 0.0;

  Touched(Model model, ContactModel contact, double radius)
      : body(std::move(model), {}, 1, contact), state(body, {.tools = {Tool{.radius = radius}}}) {}

  void tick(const ToolPose& pose, Index watched, bool timed) {
    const double taken = seconds([&] { benchmark::DoNotOptimize(step(body, state, pose)); });
    if (!timed) return;
    times.push_back(taken);
    contacts += state.tools.front().contacts;
    if (state.surface.motion.active())
      swing = std::max(swing, state.surface.motion.displacement(body, watched).norm());
  }
  void report(benchmark::State& run, const std::string& name) const {
    run.counters[name + "_median_us"] = 1e6 * median(times);
    run.counters[name + "_p99_9_us"] = 1e6 * quantile(times, 0.999);
    run.counters[name + "_contacts"] = contacts / static_cast<double>(times.size());
    run.counters[name + "_swing_mm"] = 1e3 * swing;
  }
};

void time_ticks(benchmark::State& run, Model model, Index count) {
  constexpr double radius = 0.005;
  if (model.dynamics.modes() < count) return run.SkipWithError("the file has fewer modes");
  keep_modes(model, count);
  Model still_model = model;
  still_model.dynamics = {};
  Touched still(still_model, ContactModel::quasi_static, radius),
      swings(model, ContactModel::quasi_static, radius), dynamic(model, ContactModel::dynamic, radius);
  const Index watched = top_node(still.body);
  const std::vector<ToolPose> poses = tick_poses(still.body.rest_position(watched), radius);
  const auto first = poses.size() - static_cast<std::size_t>(slide_ticks);
  for (std::size_t k = 0; k < first; ++k)
    for (Touched* touched : {&still, &swings, &dynamic}) touched->tick(poses[k], watched, false);
  for (std::size_t k = first; run.KeepRunning(); ++k) {
    for (Touched* touched : {&still, &swings, &dynamic}) touched->tick(poses[k], watched, true);
    run.SetIterationTime(swings.times.back());
  }
  still.report(run, "still");
  swings.report(run, "swings");
  dynamic.report(run, "dynamic");
}

Model baked_block() {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "palpate_dynamics_bench";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "model.toml") << R"(name = "block"
[geometry]
box = {size = [0.1, 0.1, 0.05], cells = [20, 20, 10]}
[material]
youngs_modulus = 5.5e3
poissons_ratio = 0.45
density = 1060.0
[[fixed]]
lowest = {axis = "z", percent = 0.1}
[storage]
scope = "surface"
[dynamics]
method = "modal"
modes = 200
damping = {ratios = [0.05, 0.05], frequencies = [2.0, 20.0]}
)";
  const std::filesystem::path file = folder / "block.palpate.hdf";
  bake(read_description(folder / "model.toml"), {.output = file});
  Model model = load_model(file);
  std::filesystem::remove_all(folder);
  return model;
}

template <class F>
benchmark::internal::Benchmark* add(const std::string& title, F&& function) {
  return benchmark::RegisterBenchmark(title.c_str(), std::forward<F>(function))
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

void register_products(int nodes, Precision precision, int jobs) {
  const std::string name =
      "/nodes:" + std::to_string(nodes) + "/" + name_of(precision) + "/jobs:" + std::to_string(jobs);
  add("product" + name, [=](benchmark::State& run) {
    time_product(run, std::int64_t{3} * nodes, precision, jobs);
  })->Iterations(rounds);
  add("step/packed" + name, [=](benchmark::State& run) { time_packed(run, nodes, precision, jobs); });
}

void register_boxes() {
  for (const int nodes : usual_nodes) {
    for (const Precision precision : {Precision::single_precision, Precision::double_precision})
      for (const int jobs : {1, static_cast<int>(std::thread::hardware_concurrency())})
        register_products(nodes, precision, jobs);
  }
  for (const int nodes : {500, 1000, 2000, 4000, 8000, 16000}) {
    const std::string name = "/nodes:" + std::to_string(nodes);
    add("step/sparse" + name, [=](benchmark::State& run) { time_sparse(run, box(nodes)); });
    if (nodes > usual_nodes.back()) continue;
    for (const Index count : {100, 200}) {
      for (const bool seen : {false, true}) {
        add((seen ? "step/modal_seen" : "step/modal") + name + "/modes:" + std::to_string(count),
            [=](benchmark::State& run) { time_modal(run, box_with_modes(nodes), count, seen); });
      }
    }
  }
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    for (const int hertz : {60, 1000}) {
      add(std::string("largest/") + name_of(precision) + "/hertz:" + std::to_string(hertz),
          [=](benchmark::State& run) { find_largest(run, precision, 1.0 / hertz); })
          ->Iterations(1);
    }
  }
}

/// Of a body with modes.
void register_body(const std::shared_ptr<const Model>& model, bool steps) {
  if (steps) add("step/sparse/" + model->name, [=](benchmark::State& run) { time_sparse(run, *model); });
  for (const Index count : {100, 200}) {
    const std::string name = "/" + model->name + "/modes:" + std::to_string(count);
    for (const bool seen : {false, true}) {
      if (!steps) break;
      add((seen ? "step/modal_seen" : "step/modal") + name,
          [=](benchmark::State& run) { time_modal(run, *model, count, seen); });
    }
    add("tick" + name, [=](benchmark::State& run) {
      time_ticks(run, *model, count);
    })->Iterations(slide_ticks);
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  benchmark::Initialize(&argc, argv);
  const char* file = std::getenv("PALPATE_BENCH_MODEL");
  if (file == nullptr) palpate::register_boxes();
  palpate::register_body(
      std::make_shared<palpate::Model>(file != nullptr ? palpate::load_model(file) : palpate::baked_block()),
      file != nullptr);
  benchmark::RunSpecifiedBenchmarks();
}
