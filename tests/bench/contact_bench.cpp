// What a tick of contact costs: a sphere beside the body, pressed and still, grabbed, and sliding at 50 mm/s
// over the whole of it with new nodes coming all the time. Each tick follows the last at once. Beside it the
// same contact points with their compliance by solves with a sparse factor of K, as simulators have it that
// do not keep Green's functions.
//
//   PALPATE_BENCH_MODEL=NAME.palpate.hdf   the body; else a block of 5 mm cells is baked
//   PALPATE_BENCH_RADIUS=0.005             of the sphere [m]
//
// Counters: median, 99.9 % and worst of the ticks; the mean number of contact points that are looked at and
// that are closed, of rows of the contact problem and of nodes kept near; medians of a tick's stages, on
// copies of the state. contacts:N takes a sphere so large that about N points are closed, if there is one of
// at most 20 mm.
#include <benchmark/benchmark.h>
#include <cblas.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "formats/model_file.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/factor.h"
#include "runtime/core/tick/step.h"
#include "tests/bench/palpation_paths.h"
#include "tests/bench/tick_stages.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double sliding_speed = 0.05;  // [m/s]
constexpr double depth = 0.003;         // [m]
constexpr std::int64_t ticks = 20000;
constexpr std::int64_t settling_ticks = 1000;  // untimed: coming down to the surface
constexpr std::int64_t sparse_ticks = 300;
constexpr std::int64_t stage_stride = 20;  // ticks from one whose stages are timed to the next
constexpr Index max_contacts = 32;         // as without an option

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0.0;
  const auto k = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

template <class F>
double seconds(F&& f) {
  const Clock::time_point begin = Clock::now();
  f();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A tool and where it goes, with the state after it has come to the body.
struct Motion {
  State start;
  std::vector<ToolPose> poses;

  Motion(const Body& body, double radius, double friction, std::vector<ToolPose> all)
      : start(body, {.tools = {Tool{.radius = radius, .friction = friction}}, .max_contacts = max_contacts}) {
    for (std::int64_t k = 0; k < settling_ticks; ++k) step(body, start, all[static_cast<std::size_t>(k)]);
    poses.assign(all.begin() + settling_ticks, all.end());
  }
};

std::vector<ToolPose> steady_poses(const Body& body, double radius, double pressed, double speed,
                                   std::int64_t count = ticks) {
  return test::palpation_poses(body,
                               {.radius = radius, .most_depth = pressed, .most_speed = speed, .steady = true},
                               settling_ticks + count);
}

/// Beside the body: 2 mm away from it.
Motion free_motion(const Body& body, double radius) {
  return {body, radius, 0.0, steady_poses(body, radius, -0.002, sliding_speed)};
}

Motion sliding_motion(const Body& body, double radius, double friction) {
  return {body, radius, friction, steady_poses(body, radius, depth, sliding_speed)};
}

Motion still_motion(const Body& body, double radius, double friction) {
  std::vector<ToolPose> poses = steady_poses(body, radius, depth, 0.0);
  return {body, radius, friction, std::move(poses)};
}

/// Grabs, then goes round in a circle of 1 mm, twice a second.
Motion grabbed_motion(const Body& body, double radius) {
  std::vector<ToolPose> poses = steady_poses(body, radius, depth, 0.0);
  for (std::size_t k = settling_ticks - 1; k < poses.size(); ++k) {
    const double angle = 4.0 * M_PI * test::tick * static_cast<double>(k - settling_ticks + 1);
    poses[k].position += 1e-3 * Vec3(std::cos(angle) - 1.0, std::sin(angle), 0.0);
    poses[k].grab = true;
  }
  return {body, radius, 0.0, std::move(poses)};
}

/// Mean figures of the ticks' contacts.
struct Counts {
  double looked_at = 0.0, closed = 0.0, rows = 0.0, near = 0.0, not_ok = 0.0, ticks = 0.0;

  void add(const State& state) {
    looked_at += state.contact_count;
    closed += state.tools.front().contacts;
    rows += state.scratch.problem.rows;
    near += state.surface.near.count();
    const bool handing = state.status == StepStatus::handing_over;
    not_ok += state.status == StepStatus::ok || handing ? 0.0 : 1.0;
    ticks += 1.0;
  }
  void report(benchmark::State& run) const {
    run.counters["points_looked_at"] = looked_at / ticks;
    run.counters["points_closed"] = closed / ticks;
    run.counters["rows"] = rows / ticks;
    run.counters["near_nodes"] = near / ticks;
    run.counters["ticks_not_ok"] = not_ok;
  }
};

void report_stages(benchmark::State& run, const Body& body, const Motion& motion) {
  std::vector<double> find, assemble, solve, displace, linearise;
  State state = motion.start;
  State copy = state;
  for (std::size_t k = 0; k < motion.poses.size(); ++k) {
    if (k % stage_stride == 0) {
      copy = state;
      const test::TickStages stages = test::time_stages(body, copy, motion.poses[k]);
      find.push_back(stages.find);
      assemble.push_back(stages.assemble);
      solve.push_back(stages.solve);
      displace.push_back(stages.displace);
      linearise.push_back(stages.linearise);
    }
    step(body, state, motion.poses[k]);
  }
  run.counters["find_us"] = 1e6 * quantile(find, 0.5);
  run.counters["assemble_us"] = 1e6 * quantile(assemble, 0.5);
  run.counters["solve_us"] = 1e6 * quantile(solve, 0.5);
  run.counters["displace_us"] = 1e6 * quantile(displace, 0.5);
  run.counters["linearise_us"] = 1e6 * quantile(linearise, 0.5);
}

void time_ticks(benchmark::State& run, const Body& body, const Motion& motion) {
  State state = motion.start;
  Counts counts;
  std::vector<double> times;
  std::size_t next = 0;
  while (run.KeepRunning()) {
    if (next == motion.poses.size()) {
      state = motion.start;
      next = 0;
    }
    const ToolPose& pose = motion.poses[next++];
    times.push_back(seconds([&] { benchmark::DoNotOptimize(step(body, state, pose)); }));
    run.SetIterationTime(times.back());
    counts.add(state);
  }
  run.counters["median_us"] = 1e6 * quantile(times, 0.5);
  run.counters["p99_9_us"] = 1e6 * quantile(times, 0.999);
  run.counters["worst_us"] = 1e6 * quantile(times, 1.0);
  counts.report(run);
  report_stages(run, body, motion);
}

/// K of the body, factored once, and the compliance of contact points by solves with it.
class SparseCompliance {
 public:
  explicit SparseCompliance(const Body& body)
      : stiffness_(assemble_stiffness(stiffness_input(body.model()))),
        factor_(stiffness_.K, stiffness_.node_start) {
    factor_.factorize();
  }
  ~SparseCompliance() {
    cholmod_l_free_dense(&x_, &factor_.common());
    cholmod_l_free_dense(&y_, &factor_.common());
    cholmod_l_free_dense(&e_, &factor_.common());
  }
  SparseCompliance(const SparseCompliance&) = delete;
  SparseCompliance& operator=(const SparseCompliance&) = delete;

  /// Solves K X = J^T for the contact points' rows of state.scratch.problem and sets W = J X in `problem`,
  /// which has them.
  void assemble(const Body& body, const State& state, ContactProblem& problem) {
    const auto n = static_cast<std::size_t>(factor_.order());
    const auto rows = static_cast<std::size_t>(problem.rows);
    rhs_.assign(n * rows, 0.0);
    for (std::size_t j = 0; j < rows; ++j) {
      for_each_entry(body, state, j, [&](std::size_t dof, double value) { rhs_[j * n + dof] += value; });
    }
    cholmod_dense b{};
    b.nrow = b.d = n;
    b.ncol = rows;
    b.nzmax = rhs_.size();
    b.x = rhs_.data();
    b.xtype = CHOLMOD_REAL;
    b.dtype = CHOLMOD_DOUBLE;
    auto* L = const_cast<cholmod_factor*>(&factor_.supernodal());  // cholmod_solve2 reads it only
    cholmod_l_solve2(CHOLMOD_A, L, &b, nullptr, &x_, nullptr, &y_, &e_, &factor_.common());
    const auto* X = static_cast<const double*>(x_->x);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = 0; j < rows; ++j) {
        double w = 0.0;
        for_each_entry(body, state, i, [&](std::size_t dof, double value) { w += value * X[j * n + dof]; });
        problem.w(static_cast<Index>(i), static_cast<Index>(j)) = w;
      }
    }
  }

 private:
  /// Entries of row i of J in the free dofs.
  template <class F>
  void for_each_entry(const Body& body, const State& state, std::size_t i, F&& f) const {
    const ContactRow& row = state.scratch.rows[i];
    for (std::size_t k = 0; k < 3; ++k) {
      if (row.places[k] < 0) continue;
      const auto node = static_cast<std::size_t>(state.surface.near.node(row.places[k]));
      const std::int64_t first = std::int64_t{3} * body.surface_mesh_nodes()[node];
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t dof = stiffness_.free_of_dof[static_cast<std::size_t>(first + axis)];
        if (dof >= 0) f(static_cast<std::size_t>(dof), row.body[k][axis]);
      }
    }
  }

  Stiffness stiffness_;
  Factor factor_;
  std::vector<double> rhs_;
  cholmod_dense* x_ = nullptr;
  cholmod_dense* y_ = nullptr;
  cholmod_dense* e_ = nullptr;
};

/// The contact points of a tick as a problem without W and without the springs against tilting.
void copy_contacts(const State& state, ContactProblem& problem) {
  problem.clear();
  for (Index k = 0; k < state.scratch.problem.contacts; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const bool held = state.scratch.problem.held[at] != 0;
    if (held && state.scratch.problem.rows_of(k) == 1) break;  // a spring, and all that follow
    problem.add(state.scratch.problem.friction[at], held);
  }
  std::copy_n(state.scratch.problem.b.begin(), problem.rows, problem.b.begin());
  std::copy_n(state.scratch.problem.lambda.begin(), problem.rows, problem.lambda.begin());
}

/// The largest difference of W off its diagonal, where springs are added, over its largest entry.
double difference(const ContactProblem& a, const ContactProblem& b) {
  double largest = 0.0;
  double difference = 0.0;
  for (Index i = 0; i < a.rows; ++i) {
    for (Index j = 0; j < a.rows; ++j) {
      largest = std::max(largest, std::abs(a.w(i, j)));
      if (i != j) difference = std::max(difference, std::abs(a.w(i, j) - b.w(i, j)));
    }
  }
  return largest > 0.0 ? difference / largest : 0.0;
}

/// Ticks with Green's functions, and the contact points of each by the sparse factor, in turn. Both with one
/// thread.
void time_sparse(benchmark::State& run, const Body& body, SparseCompliance& sparse, const Motion& motion) {
  State state = motion.start;
  ContactProblem problem(3, 3 * max_contacts, static_cast<Index>(state.scratch.rows.size()));
  ActiveSet active_set(static_cast<Index>(state.scratch.rows.size()));
  ConeSolver cone_solver(3 * max_contacts, static_cast<Index>(state.scratch.rows.size()));
  Counts counts;
  std::vector<double> ours, theirs;
  double worst = 0.0;
  std::size_t next = 0;
  while (run.KeepRunning()) {
    for (std::int64_t k = 0; k < ticks / sparse_ticks; ++k) {  // through the same motion in longer strides
      const ToolPose& pose = motion.poses[next++ % motion.poses.size()];
      ours.push_back(seconds([&] { step(body, state, pose); }));
    }
    counts.add(state);
    copy_contacts(state, problem);
    if (problem.rows == 0) continue;
    theirs.push_back(seconds([&] {
      sparse.assemble(body, state, problem);
      benchmark::DoNotOptimize(problem.frictionless ? active_set.solve(problem) : cone_solver.solve(problem));
    }));
    run.SetIterationTime(theirs.back());
    worst = std::max(worst, difference(problem, state.scratch.problem));
  }
  run.counters["median_us"] = 1e6 * quantile(theirs, 0.5);
  run.counters["ours_median_us"] = 1e6 * quantile(ours, 0.5);
  run.counters["ratio"] = quantile(theirs, 0.5) / quantile(ours, 0.5);
  run.counters["W_difference"] = worst;
  counts.report(run);
}

double mean_closed(const Body& body, double radius) {
  const Motion motion(body, radius, 0.0, steady_poses(body, radius, depth, sliding_speed, ticks / 5));
  State state = motion.start;
  double closed = 0.0;
  for (const ToolPose& pose : motion.poses) {
    step(body, state, pose);
    closed += state.tools.front().contacts;
  }
  return closed / static_cast<double>(motion.poses.size());
}

/// Radii, from `radius` on, of the smallest spheres with so many closed contact points in the mean. Spheres
/// that are large for the body are not tried: for many points the mesh must be fine.
std::map<int, double> radii_with(const Body& body, const std::vector<int>& contacts, double radius) {
  constexpr double growth = 1.2;
  constexpr double largest = 0.02;
  std::map<int, double> radii;
  for (const int wanted : contacts) {
    while (radius < largest && mean_closed(body, radius) < wanted) radius *= growth;
    if (radius < largest) radii[wanted] = radius;
  }
  return radii;
}

template <class F>
void add(const std::string& title, std::int64_t iterations, F&& function) {
#ifndef __clang_analyzer__  // takes what the library keeps for ever for a leak
  benchmark::RegisterBenchmark(title.c_str(), std::forward<F>(function))
      ->UseManualTime()
      ->Iterations(iterations)
      ->Unit(benchmark::kMicrosecond);
#endif
}

std::string millimetres(double radius) {
  std::string text = std::to_string(1e3 * radius);
  return text.substr(0, text.find('.') + 2) + "mm";
}

void register_body(const std::shared_ptr<const Body>& body, double radius) {
  const auto sparse = std::make_shared<SparseCompliance>(*body);
  const std::string model = "/" + body->model().name;
  const std::string sphere = model + "/sphere:" + millimetres(radius);
  add("free" + sphere, ticks,
      [=](benchmark::State& run) { time_ticks(run, *body, free_motion(*body, radius)); });
  add("grabbed" + sphere, ticks,
      [=](benchmark::State& run) { time_ticks(run, *body, grabbed_motion(*body, radius)); });
  const auto add_motions = [&](const std::string& name, double size, double friction) {
    add("still" + name, ticks,
        [=](benchmark::State& run) { time_ticks(run, *body, still_motion(*body, size, friction)); });
    add("sliding" + name, ticks,
        [=](benchmark::State& run) { time_ticks(run, *body, sliding_motion(*body, size, friction)); });
    add("sparse_factor" + name, sparse_ticks, [=](benchmark::State& run) {
      time_sparse(run, *body, *sparse, sliding_motion(*body, size, friction));
    });
  };
  const std::map<int, double> radii = radii_with(*body, {10, 20, 30}, radius);
  for (const double friction : {0.0, 0.2}) {
    const std::string kind = friction > 0.0 ? "/friction:0.2" : "/frictionless";
    add_motions(sphere + kind, radius, friction);
    for (const auto& [contacts, size] : radii) {
      const std::string with_contacts =
          model + "/contacts:" + std::to_string(contacts) + "/sphere:" + millimetres(size);
      add_motions(with_contacts + kind, size, friction);
    }
  }
}

Model default_model() {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "palpate_contact_bench";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "model.toml") << R"(name = "block"
[geometry]
box = {size = [0.1, 0.1, 0.05], cells = [20, 20, 10]}
[material]
youngs_modulus = 5.5e3
poissons_ratio = 0.45
[[fixed]]
lowest = {axis = "z", percent = 0.1}
[storage]
scope = "surface"
)";
  const std::filesystem::path file = folder / "block.palpate.hdf";
  bake(read_description(folder / "model.toml"), {.output = file});
  Model model = load_model(file);
  std::filesystem::remove_all(folder);
  return model;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  openblas_set_num_threads(1);
  benchmark::Initialize(&argc, argv);
  const char* file = std::getenv("PALPATE_BENCH_MODEL");
  const char* radius = std::getenv("PALPATE_BENCH_RADIUS");
  const auto body = std::make_shared<const palpate::Body>(file != nullptr ? palpate::load_model(file)
                                                                          : palpate::default_model());
  palpate::register_body(body, radius != nullptr ? std::strtod(radius, nullptr) : 0.005);
  benchmark::RunSpecifiedBenchmarks();
}
