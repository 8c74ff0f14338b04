// What the recorder's thread does, half a second at a time: ticks with the contact forces of a palm, from
// which pictures are computed later, and stored pictures of 100 000 surface nodes, of which it has to take 30
// a second beside the tick.
//
// Counters: ticks or pictures per second of one thread, MB/s, and bytes that each takes in the file.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <numeric>
#include <vector>

#include "formats/recording.h"

namespace palpate {
namespace {

constexpr std::size_t nodes = 100'000;
constexpr int loaded = 400;  // by a palm

/// Calls `step(writer, k)` again and again, with a checkpoint each `at_once`.
template <class Step>
void record(benchmark::State& run, std::int64_t at_once, const Step& step) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "palpate_recording_bench.mcap";
  std::int64_t written = 0;
  {
    RecordingWriter writer(path, {}, {.nodes = std::vector<Vec3>(nodes, Vec3::Zero()), .simplices = {}});
    for (auto _ : run) {  // NOLINT(clang-analyzer-deadcode.DeadStores)
      step(writer, written);
      if (++written % at_once == 0) writer.checkpoint();
    }
    writer.finish();
  }
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  run.counters["per_second"] = benchmark::Counter(static_cast<double>(written), benchmark::Counter::kIsRate);
  run.counters["MB_per_second"] = benchmark::Counter(1e-6 * bytes, benchmark::Counter::kIsRate);
  run.counters["bytes"] = bytes / static_cast<double>(written);
  std::filesystem::remove(path);
}

void record_ticks(benchmark::State& run) {
  ContactLoads loads;
  loads.node.resize(loaded);
  std::iota(loads.node.begin(), loads.node.end(), 0);
  loads.force.resize(3 * loaded);
  loads.press.resize(loaded);
  record(run, 500, [&](RecordingWriter& writer, std::int64_t k) {
    const double time = 1e-3 * static_cast<double>(k);
    writer.append(TickRecord{.time = time});
    if (k % 17 != 0) return;
    loads.tick = k;
    loads.time = time;
    writer.append(loads);
  });
}
BENCHMARK(record_ticks)->Unit(benchmark::kMicrosecond)->MinTime(4.0);

void record_pictures(benchmark::State& run) {
  SurfaceFrame frame{.displacement = std::vector<float>(3 * nodes, 0.5F),
                     .von_mises = std::vector<float>(nodes, 1.0F),
                     .pressure = std::vector<float>(nodes, 2.0F)};
  record(run, 15, [&](RecordingWriter& writer, std::int64_t k) {
    frame.tick = k;
    frame.time = static_cast<double>(k);
    writer.append(frame);
  });
}
BENCHMARK(record_pictures)->Unit(benchmark::kMillisecond)->MinTime(4.0);

}  // namespace
}  // namespace palpate

BENCHMARK_MAIN();
