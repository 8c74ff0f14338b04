// What a picture costs: encoding, and bytes on the wire, of surfaces of some nodes.
#include <benchmark/benchmark.h>

#include <cmath>

#include "runtime/scene/node_order.h"
#include "runtime/viewer/wire.h"

namespace palpate {
namespace {

struct Sample {
  Scene scene;
  SurfacePicture picture;
};

Sample sample_of(std::size_t nodes, float moved = 0.0F) {
  Sample sample;
  for (std::size_t k = 0; k < nodes; ++k) {  // a sphere
    const double z = 1.0 - 2.0 * (static_cast<double>(k) + 0.5) / static_cast<double>(nodes);
    const double around = 2.39996 * static_cast<double>(k);
    const double r = std::sqrt(1.0 - z * z);
    sample.scene.nodes.emplace_back(r * std::cos(around), r * std::sin(around), z);
  }
  sample.scene.order = order_along_curve(sample.scene.nodes);
  SurfaceFrame& frame = sample.picture.frame;
  for (const Vec3& node : sample.scene.nodes) {  // pressed near its top, and the press moves on
    const double there = 1.0 / (0.05 + (node - Vec3(0.01 * moved, 0, 1)).norm());
    for (const double u : {0.1 * there * node.x(), 0.1 * there * node.y(), -there})
      frame.displacement.push_back(static_cast<float>(1e-3 * u));
    frame.von_mises.push_back(static_cast<float>(there * there));
  }
  frame.pressure.assign(nodes, 0.0F);
  for (std::size_t k = 0; k < nodes; k += nodes / 30) frame.pressure[k] = 1.0F;
  sample.picture.contacts.resize(30);
  return sample;
}

/// A page that has the picture before, in which the tool was a hundredth of the radius away, or none.
void encode_a_frame(benchmark::State& run) {
  const auto nodes = static_cast<std::size_t>(run.range(0));
  const Sample before = sample_of(nodes);
  const Sample sample = sample_of(nodes, 1.0F);
  const WireValues base = wire_values(before.picture, before.scene, nullptr, 1);
  std::size_t bytes = 0;
  for ([[maybe_unused]] auto _ : run) {
    const WireValues values = wire_values(sample.picture, sample.scene, nullptr, 2);
    const std::string message =
        encode_frame(sample.picture, sample.scene, nullptr, values, run.range(1) != 0 ? &base : nullptr);
    bytes = message.size();
    benchmark::DoNotOptimize(message.data());
  }
  run.counters["bytes"] = static_cast<double>(bytes);
  run.counters["MB_per_s_at_30_Hz"] = 30e-6 * static_cast<double>(bytes);
}
BENCHMARK(encode_a_frame)
    ->ArgNames({"nodes", "has_base"})
    ->ArgsProduct({{500, 5000, 20000, 100000}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

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
