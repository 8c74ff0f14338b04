// Tools that rest.
#include <gtest/gtest.h>

#include <cmath>

#include "runtime/core/tick/step.h"
#include "tests/support/bodies/rest_cases.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::rest_test {
namespace {

using test::go;
using test::hold;
using test::plain;
using test::pose;

class Resting : public testing::Test {
 protected:
  Body body_{test::unit_model(3, 7, Scope::surface, Precision::double_precision)};
  double edge_ = body_.mean_surface_edge();
};

// A contact beside a held place that was there in one tick and not in the next made every eighth of them
// buzz.
TEST_F(Resting, AGrabsForceIsConstant) {
  const test::RestSurface surface(body_);
  for (std::uint64_t number = 0; number < 120; ++number) {
    const test::Rest rest = test::rest_of(body_, test::rest_case(body_, surface, number, true));
    ASSERT_TRUE(rest.touched) << number;
    EXPECT_LT(rest.change, 1e-9) << number;
    EXPECT_FALSE(has(rest.status, StepStatus::unsettled)) << number;
  }
}

TEST_F(Resting, APressesForceIsConstant) {
  const test::RestSurface surface(body_);
  int touching = 0;
  for (std::uint64_t number = 0; number < 120; ++number) {
    const test::Rest rest = test::rest_of(body_, test::rest_case(body_, surface, number, false));
    if (!rest.touched || has(rest.status, StepStatus::rigid_contact)) continue;
    ++touching;
    EXPECT_LT(rest.change, 1e-9) << number;
  }
  EXPECT_GT(touching, 60);
}

// Not where it was at the beginning of the tick before: pressed on, it would be held that much too deep.
TEST_F(Resting, APlaceThatIsGrabbedOnTheMoveIsOnTheSphere) {
  const double radius = 1.5 * edge_;
  const Vec3 above(0.47, 0.53, 1.0 + 1.1 * radius);
  const Vec3 place(0.47, 0.53, 1.0 + 0.8 * radius);
  State state(body_, {.tools = {plain({.radius = radius})}});
  const int ticks = 60;
  go(body_, state, above, pose(place), ticks);
  step(body_, state, pose(place, true));
  ASSERT_GT(state.held_count, 0);
  const double moved = (place - above).norm() / ticks;
  for (const ContactPoint& contact : state.contacts()) {
    if (!contact.held) continue;
    EXPECT_NEAR(contact.tool_point.norm(), radius, 0.02 * moved);
  }
}

TEST_F(Resting, AForceThatChangesAfterwardsIsTold) {
  const double radius = 1.5 * edge_;
  const Vec3 place(0.47, 0.53, 1.0 + 0.8 * radius);
  State state(body_, {.tools = {plain({.radius = radius, .friction = 0.0})}});
  go(body_, state, place + Vec3(0.0, 0.0, 0.3 * radius), pose(place), 60);
  hold(body_, state, pose(place), 400);
  EXPECT_EQ(state.status, StepStatus::ok);
  state.tools[0].contact_wrench.force *= 1.00001;
  EXPECT_EQ(step(body_, state, pose(place)), StepStatus::unsettled);
  hold(body_, state, pose(place), 20);
  EXPECT_EQ(step(body_, state, pose(place)), StepStatus::ok);

  // Not while something moves.
  hold(body_, state, pose(place - Vec3(0.0, 0.0, 0.01 * radius)), 1);
  state.tools[0].contact_wrench.force *= 1.1;
  EXPECT_EQ(step(body_, state, pose(place)), StepStatus::ok);
}

}  // namespace
}  // namespace palpate::rest_test
