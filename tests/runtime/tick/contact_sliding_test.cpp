// What the hand feels while a sphere slides, and that a held one comes to rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::contact_sliding_test {
namespace {

using test::go;
using test::hold;
using test::pose;

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Jumps {
  double largest = 0.0;  // change of the hand's force in a tick, of the force
  double least_force = infinity;
  double largest_force = 0.0;
  int kicks = 0;  // of the contact's force, that the hand is not given at once
  int ticks = 0;
};

/// Slides along `place` (of a share 0..1 of the way) in `ticks` ticks; begins in contact. In no tick does the
/// hand's force change by more than motion explains and the hand-over.
template <class Place>
Jumps slide(const Body& body, State& state, const Place& place, int ticks) {
  Jumps jumps{.ticks = ticks};
  Vec3 last = state.tools[0].wrench.force;
  for (int k = 1; k <= ticks; ++k) {
    const Vec3 device = state.tools[0].device.position;
    const StepStatus status = step(body, state, pose(place(static_cast<double>(k) / ticks)));
    const ToolState& tool = state.tools[0];
    const Vec3 force = tool.wrench.force;
    const double explained = (tool.local.stiffness * (tool.device.position - device)).norm();
    const double most =
        explained + tool.tool.hand_over * std::max(tool.contact_wrench.force.norm(), last.norm());
    EXPECT_LE((force - last).norm(), most * (1.0 + 1e-9));
    if ((tool.contact_wrench.force - last).norm() > most) ++jumps.kicks;
    jumps.largest = std::max(jumps.largest, (force - last).norm() / std::max(force.norm(), last.norm()));
    jumps.least_force = std::min(jumps.least_force, force.norm());
    jumps.largest_force = std::max(jumps.largest_force, force.norm());
    EXPECT_EQ(has(status, StepStatus::handing_over),
              force != tool.contact_wrench.force || tool.wrench.torque != tool.contact_wrench.torque);
    last = force;
  }
  return jumps;
}

/// A sphere of 5 mm on a surface with edges of 5.5 mm (the liver), in units of the edge.
constexpr double radius_of_edge = 5.0 / 5.5;
constexpr double slow = 0.05 / 5.5;  // 50 mm/s, edges a tick
constexpr double fast = 0.2 / 5.5;   // 200 mm/s

struct SlideCase {
  int dimension;
  bool round;
  double friction;
  double depth;  // of the radius
};

std::string name_of(const testing::TestParamInfo<SlideCase>& info) {
  const SlideCase& c = info.param;
  return std::string(c.round ? "Cylinder" : "Flat") + (c.dimension == 2 ? "InThePlane" : "") + "Friction" +
         std::to_string(static_cast<int>(100 * c.friction)) + "Depth" +
         std::to_string(static_cast<int>(100 * c.depth));
}

class SlidingTool : public testing::TestWithParam<SlideCase> {
 protected:
  Body body_{GetParam().round
                 ? test::round_model(GetParam().dimension)
                 : test::unit_model(GetParam().dimension, 6, Scope::surface, Precision::double_precision)};
  double edge_ = body_.mean_surface_edge();
  double radius_ = radius_of_edge * edge_;

  /// Over the middle of the top from end to end; over the round side by 80 degrees. `height`: of the sphere's
  /// centre.
  [[nodiscard]] Vec3 place(double share, double height) const {
    const int d = GetParam().dimension;
    if (!GetParam().round) return test::upright(d, 0.2 + 0.6 * share, 0.47, 1.0 + height);
    const double angle = 0.7 * (1.0 - 2.0 * share);
    return (1.0 + height) * Vec3(-std::sin(angle), std::cos(angle), 0.0) +
           Vec3(0.0, 0.0, d == 3 ? 0.46 : 0.0);
  }
  [[nodiscard]] double way() const { return GetParam().round ? 1.4 : 0.6; }

  Jumps slide_at(double speed, double hand_over) {
    State state(
        body_, {.tools = {Tool{.radius = radius_, .hand_over = hand_over, .friction = GetParam().friction}}});
    const double height = radius_ - GetParam().depth * radius_;
    go(body_, state, place(0.0, radius_ + 0.1 * edge_), pose(place(0.0, height)), 100);
    hold(body_, state, pose(place(0.0, height)), 200);
    const int ticks = static_cast<int>(way() / (speed * edge_));
    return slide(
        body_, state, [&](double share) { return place(share, height); }, ticks);
  }
};
INSTANTIATE_TEST_SUITE_P(Bodies, SlidingTool,
                         testing::Values(SlideCase{3, false, 0.0, 0.2}, SlideCase{3, false, 0.2, 0.2},
                                         SlideCase{3, false, 0.0, 0.6}, SlideCase{3, false, 0.2, 0.6},
                                         SlideCase{3, true, 0.0, 0.2}, SlideCase{3, true, 0.2, 0.2},
                                         SlideCase{3, true, 0.0, 0.6}, SlideCase{3, true, 0.2, 0.6},
                                         SlideCase{2, false, 0.0, 0.2}, SlideCase{2, false, 0.2, 0.2},
                                         SlideCase{2, false, 0.0, 0.6}, SlideCase{2, false, 0.2, 0.6},
                                         SlideCase{2, true, 0.0, 0.2}, SlideCase{2, true, 0.2, 0.2},
                                         SlideCase{2, true, 0.0, 0.6}, SlideCase{2, true, 0.2, 0.6}),
                         name_of);

TEST_P(SlidingTool, TheHandFeelsNoKick) {
  const Jumps at_50 = slide_at(slow, Tool{}.hand_over);
  const Jumps at_200 = slide_at(fast, Tool{}.hand_over);
  const Jumps raw_at_50 = slide_at(slow, infinity);
  const Jumps raw_at_200 = slide_at(fast, infinity);
  RecordProperty("jump_at_50_mm_s", std::to_string(at_50.largest));
  RecordProperty("jump_at_200_mm_s", std::to_string(at_200.largest));
  RecordProperty("raw_jump_at_50_mm_s", std::to_string(raw_at_50.largest));
  RecordProperty("raw_jump_at_200_mm_s", std::to_string(raw_at_200.largest));
  EXPECT_GT(raw_at_50.least_force, 0.0);
  EXPECT_GT(at_50.kicks + at_200.kicks, 0);
  // As shallow as 1 mm, a tick's motion is itself 5 % of the depth.
  EXPECT_LT(at_50.largest, std::max(0.02, slow / (GetParam().depth * radius_of_edge)));
}

struct RestCase {
  int dimension;
  double radius;  // of the edge
  double friction;
  std::vector<double> depths;  // of the radius, for a point of the edge
};

class ComesToRest : public testing::TestWithParam<RestCase> {};
INSTANTIATE_TEST_SUITE_P(Spheres, ComesToRest, testing::ValuesIn([] {
                           std::vector<RestCase> cases;
                           for (const int dimension : {2, 3}) {
                             for (const double radius : {0.0, 0.2, 1.0, 3.0}) {
                               for (const double friction : {0.0, 0.1, 0.5}) {
                                 std::vector<double> depths = {0.02, 0.1, 0.3, 0.6, 1.0};
                                 if (radius == 3.0) depths.resize(3);  // deeper is half of the body
                                 cases.push_back({dimension, radius, friction, depths});
                               }
                             }
                           }
                           return cases;
                         }()),
                         [](const testing::TestParamInfo<RestCase>& tested) {
                           const RestCase& c = tested.param;
                           return "Radius" + std::to_string(static_cast<int>(10.0 * c.radius)) + "Friction" +
                                  std::to_string(static_cast<int>(10.0 * c.friction)) +
                                  (c.dimension == 2 ? "InThePlane" : "");
                         });

/// The largest change of the contact's force from tick to tick in `ticks` ticks, of the force.
double unrest(const Body& body, State& state, const ToolPose& held, int ticks) {
  Vec3 last = state.tools[0].contact_wrench.force;
  double largest = 0.0;
  for (int k = 0; k < ticks; ++k) {
    step(body, state, held);
    const Vec3 force = state.tools[0].contact_wrench.force;
    largest = std::max(largest, (force - last).norm() / force.norm());
    last = force;
  }
  return largest;
}

// No buzz: within 100 ticks it is at rest to rounding (with friction, to the cone solver's tolerance); where
// contact moves from face to face it rings for longer, but fades.
TEST_P(ComesToRest, WhereverItIsHeld) {
  const auto& [d, radius_of_edges, friction, depths] = GetParam();
  const Body body(test::unit_model(d, 6, Scope::surface, Precision::double_precision));
  const double edge = body.mean_surface_edge();
  const double radius = radius_of_edges * edge;
  int held = 0;
  int ringing = 0;
  for (const double share : depths) {
    const double depth = share * (radius > 0.0 ? radius : edge);
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < (d == 3 ? 5 : 1); ++j) {
        const Vec3 place = test::upright(d, 0.263 + 0.1 * i, 0.281 + 0.1 * j, 1.0 + radius - depth);
        const Vec3 above = place + test::upright(d, 0.0, 0.0, depth + 0.05 * edge);
        State state(body, {.tools = {Tool{.radius = radius, .friction = friction}}});
        step(body, state, pose(above));
        go(body, state, above, pose(place), 2 + static_cast<int>(20.0 * depth / edge));
        hold(body, state, pose(place), 100);
        ASSERT_GT(state.tools[0].contacts, 0) << place.transpose();
        ++held;
        if (unrest(body, state, pose(place), 10) < 1e-9) continue;
        ++ringing;
        hold(body, state, pose(place), 3000);
        const double last = unrest(body, state, pose(place), 10);
        EXPECT_LT(last, 1e-9) << place.transpose() << " depth " << share;
      }
    }
  }
  RecordProperty("ringing_after_100_ticks", ringing);
  RecordProperty("held", held);
  EXPECT_LE(ringing, held / 20);
}

}  // namespace
}  // namespace palpate::contact_sliding_test
