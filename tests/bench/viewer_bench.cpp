// What a picture costs: encoding, and bytes on the wire, of surfaces of some nodes.
#include <benchmark/benchmark.h>

#include "runtime/viewer/wire.h"

namespace palpate {
namespace {

struct Sample {
  Scene scene;
  SurfacePicture picture;
};

Sample sample_of(std::size_t nodes) {
  Sample sample;
  sample.scene.nodes.assign(nodes, Vec3::Zero());
  SurfaceFrame& frame = sample.picture.frame;
  for (std::size_t k = 0; k < 3 * nodes; ++k)
    frame.displacement.push_back(1e-5F * static_cast<float>(k % 1000));
  for (std::size_t k = 0; k < nodes; ++k) frame.von_mises.push_back(static_cast<float>(k));
  frame.pressure.assign(nodes, 0.0F);
  for (std::size_t k = 0; k < nodes; k += nodes / 30) frame.pressure[k] = 1.0F;
  sample.picture.contacts.resize(30);
  return sample;
}

void encode_a_frame(benchmark::State& run) {
  const Sample sample = sample_of(static_cast<std::size_t>(run.range(0)));
  std::size_t bytes = 0;
  for ([[maybe_unused]] auto _ : run) {
    const std::string message = encode_frame(sample.picture, sample.scene, nullptr);
    bytes = message.size();
    benchmark::DoNotOptimize(message.data());
  }
  run.counters["bytes"] = static_cast<double>(bytes);
  run.counters["Mbit_per_s_at_60_Hz"] = 8e-6 * 60.0 * static_cast<double>(bytes);
}
BENCHMARK(encode_a_frame)->Arg(500)->Arg(5000)->Arg(50000)->Unit(benchmark::kMicrosecond);

void encode_ticks_of_a_picture(benchmark::State& run) {
  const std::vector<TickNote> ticks(static_cast<std::size_t>(run.range(0)));
  std::size_t bytes = 0;
  for ([[maybe_unused]] auto _ : run) {
    const std::string message = encode_ticks(1, ticks, 1);
    bytes = message.size();
    benchmark::DoNotOptimize(message.data());
  }
  run.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK(encode_ticks_of_a_picture)->Arg(17)->Arg(2000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace palpate

BENCHMARK_MAIN();
