// A tick on a slender body: contact with all that the tick does against rounding.
#include <gtest/gtest.h>

#include <limits>

#include "runtime/body/body.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/baked_body.h"

namespace palpate::precision_tick_test {
namespace {

Model bake_beam(const std::string& precision) {
  return test::BakedBody().bake_body(std::string(test::slender_beam) + "[storage]\nprecision = \"" +
                                     precision + "\"\n");
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
}  // namespace palpate::precision_tick_test
