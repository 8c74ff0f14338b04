// What the recorder's thread does with frames of 100 000 surface nodes: compress, write and merge them, half
// a second at a time. It has to take 30 frames a second beside the tick.
//
//   PALPATE_BENCH_RECORDING=OUT.h5   its frames; else a dent that moves over a sheet
//
// Counters: frames per second of one thread, MB/s before compression, and bytes that a node takes in the
// file.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "formats/recording.h"

namespace palpate {
namespace {

constexpr std::size_t sheet = 316;             // nodes along an edge
constexpr std::size_t frames_of_a_sheet = 32;  // that are made
constexpr std::size_t at_once = 15;            // frames in half a second at 30 per second

struct Frames {
  std::size_t nodes = 0;
  std::vector<SurfaceFrame> frames;
};

SurfaceFrame dented(double at) {
  SurfaceFrame frame;
  for (std::size_t i = 0; i < sheet * sheet; ++i) {
    const double x = static_cast<double>(i % sheet) / sheet - at,
                 y = static_cast<double>(i / sheet) / sheet - 0.5;
    const double dent = 0.005 / (1.0 + 40.0 * (x * x + y * y));
    for (const double u : {x * dent, y * dent, -dent}) frame.displacement.push_back(static_cast<float>(u));
    frame.von_mises.push_back(static_cast<float>(1e6 * dent * dent));
    frame.pressure.push_back(x * x + y * y < 0.01 ? static_cast<float>(1e5 * dent) : 0.0F);
  }
  return frame;
}

Frames make_frames() {
  Frames made;
  if (const char* path = std::getenv("PALPATE_BENCH_RECORDING")) {
    const RecordingFile file(path);
    made.nodes = file.recording().frames.surface.nodes.size();
    for (std::int64_t k = 0; k < std::ssize(file.recording().frames.tick) && k < 200; ++k)
      made.frames.push_back(file.frame(k));
    return made;
  }
  made.nodes = sheet * sheet;
  for (std::size_t k = 0; k < frames_of_a_sheet; ++k)
    made.frames.push_back(dented(0.3 + 0.4 * static_cast<double>(k) / frames_of_a_sheet));
  return made;
}

void record(benchmark::State& run) {
  const Frames made = make_frames();
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "palpate_recording_bench.h5";
  std::size_t written = 0;
  {
    RecordingWriter writer(path, {}, {.nodes = std::vector<Vec3>(made.nodes, Vec3::Zero()), .simplices = {}});
    for (auto _ : run) {  // NOLINT(clang-analyzer-deadcode.DeadStores)
      SurfaceFrame frame = made.frames[written % made.frames.size()];
      frame.tick = static_cast<std::int64_t>(written);
      frame.time = static_cast<double>(written);
      writer.append(std::move(frame));
      if (++written % at_once == 0) writer.checkpoint();
    }
    writer.finish();
  }
  const auto nodes = static_cast<double>(written * made.nodes);
  run.counters["frames_per_second"] =
      benchmark::Counter(static_cast<double>(written), benchmark::Counter::kIsRate);
  run.counters["MB_per_second"] = benchmark::Counter(20e-6 * nodes, benchmark::Counter::kIsRate);
  run.counters["bytes_per_node"] = static_cast<double>(std::filesystem::file_size(path)) / nodes;
  std::filesystem::remove(path);
}
BENCHMARK(record)->Unit(benchmark::kMillisecond)->MinTime(4.0);

}  // namespace
}  // namespace palpate

BENCHMARK_MAIN();
