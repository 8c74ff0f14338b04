// Bodies on two levels under the tick.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <thread>

#include "base/error.h"
#include "runtime/background/motion_source.h"
#include "runtime/background/surface_frames.h"
#include "runtime/background/two_level_motion.h"
#include "runtime/core/tick/step.h"
#include "runtime/core/tick/surface_motion.h"
#include "runtime/depth/deep_body.h"
#include "tests/support/bodies/bent_bodies.h"
#include "tests/support/live_session.h"

namespace palpate::two_level_tick_test {
namespace {

constexpr double degree = std::numbers::pi / 180.0, radius = 0.003;

/// Where a ball is that bends a cantilever down to an arc: it presses on the upper side, at 0.9 of the
/// length.
Vec3 on_arc(double angle) {
  const double s = 0.9 * test::bent_length, k = std::max(angle, 1e-9) / test::bent_length;
  const double turned = k * s, out = 0.5 * test::bent_height + radius;
  return Vec3(std::sin(turned) / k + out * std::sin(turned),
              0.5 * test::bent_height - (1.0 - std::cos(turned)) / k + out * std::cos(turned), 0.0);
}

struct Played {
  double force = 0.0;       // at the end [N]
  double largest_jump = 0;  // of the force from tick to tick [N]
  double angle = 0.0;       // of the end face [rad]
  double residual = 1.0;    // of a body on two levels at the end
  std::int64_t turns = 0;   // of its compliance, from the middle of the wait on
};

/// Bends a body by a ball and waits.
Played play(const Body& body, double angle, int ticks, int wait) {
  State state(body, {.tools = {Tool{.radius = radius, .reach = 0.01}}});
  std::unique_ptr<MotionSource> source;
  if (body.contact_model() != ContactModel::quasi_static)
    source = std::make_unique<MotionSource>(body, state, MotionSourceOptions{.in_background = false});
  const auto telling = [&] { return dynamic_cast<const TwoLevelMotion&>(source->stepper()).telling(); };
  const bool is_deep = body.contact_model() == ContactModel::two_level;
  Played played;
  for (int k = 0; k < ticks + wait; ++k) {
    if (source) source->receive(state);
    step(body, state, {.position = on_arc(angle * std::min(1.0, static_cast<double>(k) / ticks))});
    if (source) source->post(state);
    const double now = state.tools[0].wrench.force.norm();
    played.largest_jump = std::max(played.largest_jump, std::abs(now - played.force));
    played.force = now;
    if (is_deep && k == ticks + wait / 2) played.turns = telling().turns;
  }
  std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
  surface_displacement(body, state, u);
  const test::EndFace face(body.model().mesh);
  played.angle = -face.angle(test::places_of(body, u));
  if (is_deep) {
    played.residual = telling().last_residual;
    played.turns = telling().turns - played.turns;
  }
  return played;
}

// The force on the tool and the surface are those of a corotational body, bent by the same ball.
TEST(TwoLevelTick, FeelsLikeTheCorotationalBody) {
  const Model model = test::bent_model(ElementType::quad4);
  const Body deep = deep_body(model), linear{Model(model)};
  const Body live = test::live_session(model, {.solver = LiveLaw::corotational, .mass_damping = 20.0});
  for (const double angle : {10.0, 45.0, 80.0, 120.0}) {
    const Played by_levels = play(deep, angle * degree, 2000, 500),
                 by_live = play(live, angle * degree, 1000, 1000),
                 by_linear = play(linear, angle * degree, 2000, 100);
    std::printf(
        "%g degrees: end face at %.1f, %.1f, %.1f; force %.5g corotational, two levels %+.2f %%, linear "
        "%+.2f "
        "%%; jump %.2g %%\n",
        angle, by_live.angle / degree, by_levels.angle / degree, by_linear.angle / degree, by_live.force,
        100 * (by_levels.force / by_live.force - 1), 100 * (by_linear.force / by_live.force - 1),
        100 * by_levels.largest_jump / by_levels.force);
    EXPECT_LT(by_levels.residual, 1e-5);
    EXPECT_LT(by_levels.turns, 13);  // of 25 steps
    EXPECT_LT(by_levels.largest_jump, 0.005 * by_levels.force);
    EXPECT_NEAR(by_levels.force / by_live.force, 1.0, 0.05);
    EXPECT_NEAR(by_levels.angle / by_live.angle, 1.0, 0.02);
  }
}

TEST(TwoLevelTick, TwoRunsAreEqual) {
  const Model model = test::bent_model(ElementType::quad4);
  const Body body = deep_body(model);
  const Played one = play(body, 60.0 * degree, 300, 50), other = play(body, 60.0 * degree, 300, 50);
  EXPECT_EQ(one.force, other.force);
  EXPECT_EQ(one.largest_jump, other.largest_jump);
}

// Beside a ball that bends a tongue fast, the surface is where its displacement puts it.
TEST(TwoLevelTick, TheSurfaceBesideATouchIsWhereTheBodyIs) {
  const Body body = deep_body(test::bent_model(ElementType::hex8), 1, true);
  ASSERT_NE(body.local(), nullptr);
  State state(body, {.tools = {Tool{.radius = radius, .reach = 0.01}}});
  MotionSource source(body, state, MotionSourceOptions{.in_background = false});
  std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
  double farthest = 0.0;
  Index looked_at = 0;
  constexpr int ticks = 400;
  for (int k = 0; k < ticks; ++k) {
    source.receive(state);
    const Vec3 arc = on_arc(60.0 * degree * k / ticks);
    step(body, state,
         {.position = Vec3(arc.x(), 0.5 * test::bent_height, arc.y() + 0.5 * test::bent_height)});
    source.post(state);
    EXPECT_EQ(state.tools[0].surface_change.norm(), 0.0);  // what the motion corrects explains no force
    if (k % 10 != 0 || state.tools[0].contacts == 0) continue;
    surface_displacement(body, state, u);
    for (Index node = 0; node < std::ssize(body.surface_rest_positions()); ++node) {
      const Vec3 there = state.surface.tree.position(node);
      const double away = (there - state.tools[0].pose.position).norm() - radius;
      if (away > 2.0 * body.mean_surface_edge() || !body.surface_moves(node)) continue;
      Vec3 expected =
          body.surface_rest_positions()[node] + state.surface.near.load().local_displacement(node);
      const SurfaceParts parts = body.surface_parts(node);
      for (std::size_t i = 0; i < parts.stored.size(); ++i)
        expected += parts.weights[i] * vector_at(u, 3, parts.stored[i]);
      farthest = std::max(farthest, (there - expected).norm());
      ++looked_at;
    }
  }
  source.receive(state);
  FreeMotion motion = state.surface.motion;
  const auto places = body.surface_rest_positions();
  const auto tip = static_cast<Index>(std::distance(
      places.begin(), std::max_element(places.begin(), places.end(),
                                       [](const Vec3& a, const Vec3& b) { return a.x() < b.x(); })));
  static_cast<void>(motion.at(body, tip));
  motion.begin_tick(body);
  EXPECT_GT(motion.advance(body, tip).norm(), 0.0);
  EXPECT_EQ(motion.advance(body, tip).norm(), 0.0);  // a node is at several triangles, and moves once
  std::printf("%d places, off by %.2g edges at most\n", looked_at, farthest / body.mean_surface_edge());
  EXPECT_GT(looked_at, 100);
  EXPECT_LT(farthest, 0.1 * body.mean_surface_edge());
}

// A tick that ran while two steps ended would pass over the first one's sample, which a replay could not
// know.
TEST(TwoLevelTick, EachSampleIsReceived) {
  const Model model = test::bent_model(ElementType::hex8);
  const Body deep = deep_body(model),
             live = test::live_session(model, {.solver = LiveLaw::corotational, .mass_damping = 20.0});
  for (const Body* body : {&deep, &live}) {
    State state(*body, {.tools = {Tool{.radius = radius, .reach = 0.01}}});
    MotionSource source(*body, state, {});
    const auto tick = [&](bool receives) {
      if (receives) source.receive(state);
      step(*body, state, {.position = on_arc(0.0)});
      source.post(state);
    };
    const auto tick_until_job = [&](std::int64_t number, bool receives) {
      while (state.surface.motion.job().step < number) tick(receives);
    };
    const auto wait_for_steps = [&](std::int64_t count) {
      const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
      while (source.steps() < count && std::chrono::steady_clock::now() < end) std::this_thread::yield();
      return source.steps() >= count;
    };
    tick_until_job(1, true);
    ASSERT_TRUE(wait_for_steps(1));
    tick_until_job(2, false);  // as if the sample had come just before the job was posted
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(source.steps(), 1);
    tick(true);
    EXPECT_EQ(state.surface.motion.sample_step(), 1);
    if (body == &deep) tick_until_job(3, true);  // the second job's forces are of the sample before
    ASSERT_TRUE(wait_for_steps(2));
    source.receive(state);
    EXPECT_EQ(state.surface.motion.sample_step(), body == &deep ? 3 : 2);
  }
}

/// Ticks as on a busy machine, where each step's sample comes `late` ticks after the step was asked for.
class LatePlay {
 public:
  LatePlay(const Body& body, std::int64_t late)
      : body_(body),
        late_(late),
        state_(body, {.tools = {Tool{.radius = radius, .reach = 0.01}}}),
        source_(body, state_, {}) {}

  [[nodiscard]] const ToolState& tick(const Vec3& place) {
    if (asked_ >= 0 && ticks_ - asked_ >= late_) {
      source_.receive(state_);
      asked_ = -1;
    }
    const std::int64_t before = state_.surface.motion.job().step;
    step(body_, state_, {.position = place});
    source_.post(state_);
    if (asked_ < 0 && state_.surface.motion.job().step != before) {
      asked_ = ticks_;
      while (source_.steps() == steps_) std::this_thread::yield();  // it is done, and not yet received
      steps_ = source_.steps();
    }
    ++ticks_;
    return state_.tools[0];
  }

 private:
  const Body& body_;
  std::int64_t late_, ticks_ = 0, asked_ = -1, steps_ = 0;
  State state_;
  MotionSource source_;
};

// A ball that bends a tongue faster than steps end, ten times over, is felt throughout, and ends as in time.
TEST(TwoLevelTick, LateStepsLoseNoTool) {
  const Body body = deep_body(test::bent_model(ElementType::hex8));
  std::vector<double> force;
  for (const int late : {0, 50, 100, 200}) {
    LatePlay play(body, late);
    constexpr int ticks = 300;
    int lost = 0, unsettled = 0;
    double jump = 0.0, last = 0.0;
    StepStatus at_end = StepStatus::ok;
    for (int k = 0; k < ticks + 3000; ++k) {
      const Vec3 arc = on_arc(40.0 * degree * std::min(k, ticks) / ticks);
      const ToolState& tool =
          play.tick(Vec3(arc.x(), 0.5 * test::bent_height, arc.y() + 0.5 * test::bent_height));
      if (last > 0.0 && tool.contacts == 0) ++lost;
      at_end = tool.status;
      if (has(at_end, StepStatus::unsettled)) ++unsettled;
      const double now = tool.wrench.force.norm();
      jump = std::max(jump, std::abs(now - last));
      last = now;
    }
    force.push_back(last);
    std::printf("late by %d ticks: force %.5g N, %d ticks without contact, largest change %.2g N\n", late,
                last, lost, jump);
    EXPECT_EQ(lost, 0);
    EXPECT_EQ(unsettled > 0, late > 50);  // its force changes long after the ball has come to rest
    EXPECT_FALSE(has(at_end, StepStatus::unsettled));
    EXPECT_LT(jump, 0.015 * last);  // 0.013; 0.019 where the nodes are torn apart
    EXPECT_NEAR(last / force.front(), 1.0, 1e-3);
  }
}

/// Largest difference of two fields, in terms of the largest value of the second one.
double difference(const std::vector<float>& a, const std::vector<float>& b) {
  double most = 0.0, largest = 0.0;
  EXPECT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < b.size(); ++k) {
    if (std::isnan(b[k])) continue;
    largest = std::max(largest, static_cast<double>(std::abs(b[k])));
    most = std::max(most, static_cast<double>(std::abs(a[k] - b[k])));
  }
  return most / std::max(largest, 1e-30);
}

// A recording keeps the contact forces and the coarse field: pictures follow from them.
TEST(TwoLevelTick, PicturesFollowFromForcesAndTheCoarseField) {
  for (const bool local : {false, true}) {
    const Body body = deep_body(test::bent_model(ElementType::hex8), local ? 2 : 1, local);
    ASSERT_TRUE(pictures_follow_from_contacts(body));
    State state(body, {.tools = {Tool{.radius = radius, .reach = 0.01}}});
    MotionSource source(body, state, MotionSourceOptions{.in_background = false});
    ContactLoads loads;
    SurfaceFrame frame;
    SurfaceFrames in_short(body, state, {.ticks_per_frame = 1, .in_background = false, .contacts_only = true},
                           [&](SurfacePicture picture) { loads = std::move(picture.loads); });
    SurfaceFrames whole(body, state, {.ticks_per_frame = 1, .in_background = false},
                        [&](SurfacePicture picture) { frame = std::move(picture.frame); });
    PictureMaker maker(body);
    constexpr int ticks = 400, wait = 200;
    double moving = 0.0, resting = 0.0, stress = 0.0;
    for (int k = 0; k <= ticks + wait; ++k) {
      source.receive(state);
      const Vec3 arc = on_arc(60.0 * degree * std::min(k, ticks) / ticks);
      step(body, state,
           {.position = Vec3(arc.x(), 0.5 * test::bent_height, arc.y() + 0.5 * test::bent_height)});
      source.post(state);
      if (k % 25 != 0 || k == 0) continue;
      in_short.post(state, k, 1e-3 * k);
      whole.post(state, k, 1e-3 * k);
      keep_recorded(body, frame);
      const SurfaceFrame later = maker.picture(loads);
      const double off = difference(later.displacement, frame.displacement);
      if (k < ticks) moving = std::max(moving, off);
      if (k < ticks + wait) continue;
      resting = off;
      stress = difference(later.von_mises, frame.von_mises);
    }
    std::printf("off by %.2g while it moves, %.2g at rest; stress there by %.2g\n", moving, resting, stress);
    EXPECT_LT(moving, 0.03);  // of second order in what a step moves
    EXPECT_LT(resting, 1e-3);
    EXPECT_LT(stress, 1e-2);
    loads.field.pop_back();
    EXPECT_THROW(static_cast<void>(maker.picture(loads)), Error);
  }
}

}  // namespace
}  // namespace palpate::two_level_tick_test
