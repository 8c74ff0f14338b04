// Ticks with overlays: against the same ticks on a finer body, and what happens when patches come and go.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "runtime/background/patch_source.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::overlay_step_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Case {
  ElementType element;
  int cells;
  int refinement;
  double radius;
  double friction;
  bool grab;
};

std::string name_of(const testing::TestParamInfo<Case>& tested) {
  const Case& c = tested.param;
  return std::string(traits(c.element).name) + "Cells" + std::to_string(c.cells) + "Refinement" +
         std::to_string(c.refinement) + (c.radius > 0.0 ? "Sphere" : "Point") +
         (c.friction > 0.0 ? "Rough" : "") + (c.grab ? "Grabs" : "");
}

/// A coarse body whose overlay is over all of it, and the body that is as fine everywhere.
class WholeOverlay : public testing::TestWithParam<Case> {
 protected:
  Body coarse_{
      test::unit_model(GetParam().element, GetParam().cells, Scope::full, Precision::double_precision),
      {},
      GetParam().refinement};
  Body fine_{test::unit_model(GetParam().element, GetParam().cells* GetParam().refinement, Scope::full,
                              Precision::double_precision)};
  int d_ = coarse_.dimension();

  [[nodiscard]] std::shared_ptr<const Patch> patch() const {
    PatchMaker maker(coarse_, 2 * GetParam().cells);  // all elements
    const Index centre = coarse_.nearest_surface_node(test::top_middle(d_)).node;
    return maker.make({&centre, 1});
  }

  [[nodiscard]] State state(const Body& body, Index patch_nodes) const {
    return State(body, {.tools = {Tool{.radius = GetParam().radius,
                                       .hand_over = infinity,
                                       .reach = 0.5,
                                       .friction = GetParam().friction}},
                        .patch_nodes = patch_nodes});
  }

  [[nodiscard]] ToolPose pose(int tick) const {
    const double down = 0.05 - 0.0006 * std::min(tick, 200);
    const double along = 0.0008 * std::max(0, tick - 200);
    return {.position = test::upright(d_, 0.31 + along, 0.43 + 0.5 * along, 1.0 + GetParam().radius + down),
            .grab = GetParam().grab && tick > 150};
  }
};

INSTANTIATE_TEST_SUITE_P(Elements, WholeOverlay,
                         testing::Values(Case{ElementType::quad4, 3, 3, 0.3, 0.0, false},
                                         Case{ElementType::tri3, 4, 2, 0.3, 0.4, false},
                                         Case{ElementType::tet4, 2, 2, 0.3, 0.0, false},
                                         Case{ElementType::tet4, 2, 3, 0.0, 0.0, false},
                                         Case{ElementType::tet4, 2, 3, 0.3, 0.3, false},
                                         Case{ElementType::tet4, 2, 2, 0.3, 0.0, true},
                                         Case{ElementType::hex8, 2, 3, 0.25, 0.0, false}),
                         name_of);

TEST_P(WholeOverlay, FeelsAsTheFinerBodyDoes) {
  const std::shared_ptr<const Patch> patch = this->patch();
  State with = state(coarse_, static_cast<Index>(patch->stored_nodes().size()));
  with.surface.patch = patch;
  State finer = state(fine_, 0);
  double largest = 0.0;
  int touching = 0;
  for (int tick = 0; tick < 400; ++tick) {
    step(coarse_, with, pose(tick));
    step(fine_, finer, pose(tick));
    const Vec3 force = finer.tools.front().wrench.force;
    largest = std::max(largest, force.norm());
    ASSERT_LE((with.tools.front().wrench.force - force).norm(), 2e-5 * largest) << "tick " << tick;
    touching += with.tools.front().contacts > 0 ? 1 : 0;
  }
  EXPECT_GT(touching, 200);
  EXPECT_EQ(with.surface.near.patch(), patch);

  // And the coarse mesh alone is another body.
  State without = state(coarse_, 0);
  for (int tick = 0; tick < 200; ++tick) step(coarse_, without, pose(tick));
  State again = state(fine_, 0);
  for (int tick = 0; tick < 200; ++tick) step(fine_, again, pose(tick));
  const Vec3 force = again.tools.front().wrench.force;
  EXPECT_GT((without.tools.front().wrench.force - force).norm(), 0.05 * force.norm());

  // All surfaces agree, node by node.
  std::vector<double> stored(static_cast<std::size_t>(coarse_.greens().order()));
  std::vector<Vec3> u(coarse_.surface_rest_positions().size());
  surface_displacement(coarse_, with.surface.near.load(), stored, u);
  std::vector<double> fine_stored(static_cast<std::size_t>(fine_.greens().order()));
  std::vector<Vec3> fine_u(fine_.surface_rest_positions().size());
  surface_displacement(fine_, finer.surface.near.load(), fine_stored, fine_u);
  ASSERT_EQ(u.size(), fine_u.size());
  double most = 0.0;
  for (const Vec3& displacement : fine_u) most = std::max(most, displacement.norm());
  for (std::size_t node = 0; node < u.size(); ++node) {
    const Vec3& place = coarse_.surface_rest_positions()[node];
    const std::span<const Vec3> places = fine_.surface_rest_positions();
    const auto same = std::find_if(places.begin(), places.end(),
                                   [&](const Vec3& other) { return (other - place).norm() < 1e-9; });
    ASSERT_NE(same, places.end());
    EXPECT_LT((u[node] - fine_u[static_cast<std::size_t>(same - places.begin())]).norm(), 1e-4 * most);
  }
}

/// A block with a tool on its top, and patches round the nodes there.
class Sliding : public testing::TestWithParam<int> {
 protected:
  Body body_{
      test::unit_model(GetParam(), GetParam() == 3 ? 4 : 8, Scope::full, Precision::double_precision), {}, 3};
  double radius_ = 0.2;
  Index room_ = patch_room(body_, 2, 2);

  [[nodiscard]] State state(double hand_over = Tool{}.hand_over) const {
    return State(body_, {.tools = {Tool{.radius = radius_, .hand_over = hand_over}}, .patch_nodes = room_});
  }
  [[nodiscard]] ToolPose pose(double x, double depth) const {
    return {.position = test::upright(GetParam(), x, 0.5, 1.0 + radius_ - depth)};
  }
  /// Down to `depth` at x = 0.3.
  void press(State& state, double depth, PatchSource* source) const {
    for (int tick = 0; tick <= 100; ++tick) {
      if (source != nullptr) source->serve(state);
      step(body_, state, pose(0.3, depth * (2.0 * tick / 100.0 - 1.0)));
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Dimension, Sliding, testing::Values(2, 3));

TEST_P(Sliding, ChangesThePatchWithoutAKick) {
  State state = this->state();
  PatchSource source(body_, state, {.in_background = false});
  press(state, 0.05, nullptr);
  const Vec3 before = state.tools.front().wrench.force;
  const Vec3 at = state.surface.near.displacement(state.surface.near.place_of(
      state.contacts()[0].nodes[0] >= 0 ? state.contacts()[0].nodes[0] : state.contacts()[0].nodes[1]));
  // From none to one, under a tool that rests: the force falls to what the finer body has, a little a tick.
  Vec3 last = before;
  double largest = 0.0;
  for (int tick = 0; tick < 400; ++tick) {
    source.serve(state);
    step(body_, state, pose(0.3, 0.05));
    const Vec3 force = state.tools.front().wrench.force;
    largest = std::max(largest, (force - last).norm() / last.norm());
    last = force;
  }
  ASSERT_NE(state.surface.near.patch(), nullptr);
  EXPECT_LT(last.norm(), 0.95 * before.norm());
  EXPECT_LT(largest, 1.01 * Tool{}.hand_over);
  EXPECT_GT(at.norm(), 0.0);
  EXPECT_LT((last - state.tools.front().contact_wrench.force).norm(), 1e-6 * last.norm());
}

TEST_P(Sliding, FollowsTheToolWithoutAJump) {
  State state = this->state();
  PatchSource source(body_, state, {.in_background = false});
  press(state, 0.05, &source);
  Vec3 last = state.tools.front().wrench.force;
  double largest = 0.0;
  for (int tick = 0; tick < 800; ++tick) {
    source.serve(state);
    EXPECT_FALSE(has(step(body_, state, pose(0.3 + 0.0005 * tick, 0.05)), StepStatus::older_patch));
    const ToolState& tool = state.tools.front();
    const double explained =
        (tool.local.stiffness * (tool.device.position - tool.last_device.position)).norm();
    largest = std::max(largest, ((tool.wrench.force - last).norm() - explained) / tool.wrench.force.norm());
    last = tool.wrench.force;
  }
  EXPECT_GE(source.counts().switches, 1);
  EXPECT_LE(source.counts().switches, 4);
  EXPECT_EQ(source.counts().older_in_contact, 0);
  EXPECT_LT(largest, 1.01 * Tool{}.hand_over);
}

// Wherever a tool rests, also between two nodes, it keeps its patch. (Chosen by force it did not: what is
// beside the patch is stiffer, carries more, and called the patch to it.)
TEST_P(Sliding, KeepsThePatchUnderAToolThatRests) {
  const int cells = 6;
  const Body body(test::unit_model(GetParam(), cells, Scope::full, Precision::double_precision), {}, 4);
  const double size = 1.0 / cells;  // of an element, and the radius
  for (int place = -20; place <= 20; ++place) {
    State state(body, {.tools = {Tool{.radius = size, .hand_over = infinity}},
                       .max_contacts = 100,
                       .patch_nodes = patch_room(body, 1, 1)});
    PatchSource source(body, state, {.rings = 1, .in_background = false});
    std::int64_t switches = 0;
    for (int k = 0; k <= 400; ++k) {
      const double depth = 0.1 * (2.0 * std::min(k, 200) / 200.0 - 1.0);
      source.serve(state);
      step(body, state,
           {.position = test::upright(GetParam(), 0.5 + 0.05 * place * size, 0.5 - 0.05 * place * size,
                                      1.0 + (1.0 - depth) * size)});
      if (k == 220) switches = source.counts().switches;
    }
    EXPECT_EQ(source.counts().switches, switches) << 0.05 * place << " elements along";
    EXPECT_GT(state.tools.front().contacts, 0);
  }
}

TEST_P(Sliding, BuildsAheadInTheBackground) {
  State state = this->state();
  PatchSource source(body_, state, {});
  const int all = GetParam() == 2 ? 3 : 7;  // its own, and those of the neighbours
  // A tool that waits over the body has its patch, and those round it, before it touches.
  for (int tick = 0; tick < 600'000 && (state.surface.patch == nullptr || source.built() < all); ++tick) {
    source.serve(state);
    step(body_, state, pose(0.3, -0.1));
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  ASSERT_NE(state.surface.patch, nullptr);
  EXPECT_GE(source.built(), all);
  EXPECT_EQ(source.counts().in_contact, 0);
  State same = this->state();
  PatchSource waiting(body_, same, {.in_background = false});
  for (int tick = 0; tick < 100; ++tick) {
    waiting.serve(same);
    step(body_, same, pose(0.3, -0.1));
  }
  EXPECT_TRUE(
      std::equal(state.surface.patch->surface_nodes().begin(), state.surface.patch->surface_nodes().end(),
                 same.surface.patch->surface_nodes().begin(), same.surface.patch->surface_nodes().end()));
}

TEST_P(Sliding, KeepsToItsMemory) {
  const auto go_round = [&](std::size_t memory) {
    State state = this->state();
    PatchSource source(body_, state, {.memory = memory, .in_background = false});
    press(state, 0.05, &source);
    const std::size_t first = source.bytes();
    for (int tick = 0; tick < 1600; ++tick) {
      source.serve(state);
      step(body_, state, pose(0.5 - 0.3 * std::cos(2.0 * M_PI * tick / 800.0), 0.05));
      EXPECT_LE(source.bytes(), memory);
      EXPECT_NE(state.surface.patch, nullptr);
    }
    EXPECT_GE(source.counts().switches, 4);
    EXPECT_EQ(source.counts().older_in_contact, 0);
    return std::pair(first, source.built());
  };
  const auto [one, all] = go_round(std::size_t{1} << 30);
  const auto [again, anew] = go_round(one + one / 2);
  EXPECT_EQ(again, one);
  EXPECT_GT(anew, all);  // what was let go of is built anew
}

// A builder without memory for the neighbours leaves them, and does not let go of one for the other for ever.
TEST_P(Sliding, RestsWhenItsMemoryIsFull) {
  State state = this->state();
  std::size_t one = 0;
  {
    PatchSource source(body_, state, {.in_background = false});
    press(state, 0.05, &source);
    one = source.bytes();
  }
  State again = this->state();
  PatchSource source(body_, again, {.memory = one + one / 2});
  for (int tick = 0; tick < 600'000 && again.surface.patch == nullptr; ++tick) {
    source.serve(again);
    step(body_, again, pose(0.3, -0.1));
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  ASSERT_NE(again.surface.patch, nullptr);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_LE(source.built(), 2);
}

// Each alone has its own patch; beside each other they share one that is over the elements of both.
TEST_P(Sliding, MergesThePatchesOfTwoTools) {
  State two(body_, {.tools = {Tool{.radius = 0.1, .hand_over = infinity},
                              Tool{.radius = 0.1, .hand_over = infinity}},
                    .patch_nodes = room_});
  PatchSource source(body_, two, {.in_background = false});
  std::vector<ToolPose> poses(2);
  for (int tick = 0; tick <= 200; ++tick) {
    const double depth = 0.04 * (tick / 100.0 - 1.0);
    poses[0].position = test::upright(GetParam(), 0.25, 0.5, 1.1 - depth);
    poses[1].position = test::upright(GetParam(), 0.75, 0.5, 1.1 - depth);
    source.serve(two);
    step(body_, two, poses);
  }
  PatchMaker maker(body_, 2);
  std::vector<Index> centres;
  for (const double x : {0.25, 0.75})
    centres.push_back(body_.nearest_surface_node(test::upright(GetParam(), x, 0.5, 1.0)).node);
  const std::shared_ptr<const Patch> both = maker.make(centres);
  const std::shared_ptr<const Patch> one = maker.make({centres.data(), 1});
  EXPECT_EQ(two.surface.patch->surface_nodes().size(), both->surface_nodes().size());
  EXPECT_GT(both->surface_nodes().size(), one->surface_nodes().size());
  EXPECT_LT(both->surface_nodes().size(), 2 * one->surface_nodes().size());
  EXPECT_GT(two.tools[0].contacts, 0);
  EXPECT_GT(two.tools[1].contacts, 0);

  // Symmetric tools feel the same, as the patch is over both.
  if (GetParam() == 2) {
    EXPECT_NEAR(two.tools[0].wrench.force.y(), two.tools[1].wrench.force.y(),
                1e-4 * two.tools[0].wrench.force.norm());
  }
}

TEST(PatchRoom, RefusesAFileThatKeepsTooLittle) {
  const Body body(test::unit_model(3, 6, Scope::surface, Precision::double_precision), {}, 2);
  EXPECT_THROW(patch_room(body, 1, 1), Error);
}

// A state without room for a patch goes on without it, and says so.
TEST_P(Sliding, GoesOnWithoutAPatchThatIsTooLarge) {
  State state(body_, {.tools = {Tool{.radius = radius_}}, .patch_nodes = 3});
  const Index centre = body_.nearest_surface_node(test::top_middle(GetParam())).node;
  state.surface.patch = PatchMaker(body_, 1).make({&centre, 1});
  EXPECT_TRUE(has(step(body_, state, pose(0.3, -0.1)), StepStatus::capacity_full));
  EXPECT_EQ(state.surface.near.patch(), nullptr);
  press(state, 0.05, nullptr);
  EXPECT_GT(state.tools.front().contacts, 0);
}

}  // namespace
}  // namespace palpate::overlay_step_test
