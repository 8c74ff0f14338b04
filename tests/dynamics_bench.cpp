// What it costs that a body swings.
//
// product: the packed product against reading. Rounds of products and of plain reading with as many threads
// from a block of the same size alternate. Counters: medians of the bytes of the packed triangle over the
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
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "formats/model_file.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "precompute/dynamics.h"
#include "runtime/modal_newmark.h"
#include "runtime/packed_newmark.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

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

std::string name_of(Precision precision) {
  return precision == Precision::single_precision ? "single" : "double";
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
const std::vector<Sum> sums = {sum_of<32, 1>, sum_of<64, 1>, sum_of<128, 1>, sum_of<32, 2>, sum_of<16, 4>};

/// Bytes a second at which `jobs` threads read their parts of a block, again and again for a while.
double reading_rate(const std::vector<double>& block, int jobs, Sum sum) {
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
  const std::vector<double> block(static_cast<std::size_t>(bytes / 8.0), 1.0);
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

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  using namespace palpate;
  openblas_set_num_threads(1);
  benchmark::Initialize(&argc, argv);
  for (const int nodes : usual_nodes)
    for (const Precision precision : {Precision::single_precision, Precision::double_precision})
      for (const int jobs : {1, 2})
        benchmark::RegisterBenchmark(("product/" + std::to_string(nodes) + "/" + name_of(precision) + "/jobs:" +
                                      std::to_string(jobs)).c_str(),
                                     [=](benchmark::State& run) { time_product(run, 3 * nodes, precision, jobs); })
            ->UseManualTime()->Iterations(9)->Unit(benchmark::kMicrosecond);
  benchmark::RunSpecifiedBenchmarks();
}
