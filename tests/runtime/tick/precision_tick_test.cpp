// A tick on a slender body: contact with all that the tick does against rounding.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "formats/model_file.h"
#include "precompute/bake.h"
#include "runtime/tick/step.h"

namespace palpate {
namespace {

Model bake_beam(const std::string& precision) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("palpate-tick-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "model.toml") << R"(name = "beam"
[geometry]
box = {size = [0.3, 0.01, 0.01], cells = [40, 1, 1]}
[mesh]
element = "hex8"
[material]
youngs_modulus = 1e6
poissons_ratio = 0.3
[[fixed]]
lowest = {axis = "x", percent = 1}
[storage]
precision = ")" << precision << "\"\n";
  testing::internal::CaptureStderr();
  bake(read_description(folder / "model.toml"), {.output = folder / "b.hdf", .jobs = 1, .dry_run = false});
  testing::internal::GetCapturedStderr();
  Model model = load_model(folder / "b.hdf");
  std::filesystem::remove_all(folder);
  return model;
}

/// A sphere pressed on the free end.
Vec3 pressing_force(Model model) {
  const Body body(std::move(model));
  Tool sphere;
  sphere.radius = 0.02;
  sphere.hand_over = std::numeric_limits<double>::infinity();
  State state(body, {.tools = {sphere}});
  ToolPose tool;
  for (int tick = 0; tick <= 200; ++tick) {
    tool.position = Vec3(0.29, 0.004, 0.0301 - 5e-6 * tick);
    step(body, state, tool);
  }
  EXPECT_GE(state.tools[0].contacts, 1);
  return state.tools[0].wrench.force;
}

TEST(PrecisionTick, ForcesOnASlenderBodyAreThoseOfDoubleByDefault) {
  const Model beam = bake_beam("auto");
  EXPECT_EQ(beam.greens.precision(), Precision::split_precision);
  const Vec3 expected = pressing_force(bake_beam("double")), found = pressing_force(beam);
  EXPECT_GT(expected.norm(), 0.0);
  EXPECT_LE((found - expected).norm(), 1e-4 * expected.norm());
}

}  // namespace
}  // namespace palpate
