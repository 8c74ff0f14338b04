// Warped bodies under the tick.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "runtime/background/motion_source.h"
#include "runtime/background/warped_motion.h"
#include "runtime/core/tick/step.h"
#include "runtime/core/tick/surface_motion.h"
#include "tests/support/bodies/warp_cases.h"
#include "tests/support/live_session.h"

namespace palpate::warped_tick_test {
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
  double residual = 1.0;    // of a warped body at the end
  double off = 0.0;  // of the surface against a warp to the end under the same forces, of its displacement
};

/// Bends a body by a ball and waits.
Played play(const Body& body, double angle, int ticks, int wait) {
  State state(body, {.tools = {Tool{.radius = radius, .reach = 0.01}}});
  std::unique_ptr<MotionSource> source;
  if (body.contact_model() != ContactModel::quasi_static)
    source = std::make_unique<MotionSource>(body, state, MotionSourceOptions{.in_background = false});
  Played played;
  for (int k = 0; k < ticks + wait; ++k) {
    if (source) source->receive(state);
    step(body, state, {.position = on_arc(angle * std::min(1.0, static_cast<double>(k) / ticks))});
    if (source) source->post(state);
    const double now = state.tools[0].wrench.force.norm();
    played.largest_jump = std::max(played.largest_jump, std::abs(now - played.force));
    played.force = now;
  }
  std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
  surface_displacement(body, state, u);
  const test::EndFace face(body.model().mesh);
  played.angle = -face.angle(test::places_of(body, u));
  if (body.contact_model() == ContactModel::warped) {
    const SurfaceWarp warp(warp_surface(body));
    played.residual = dynamic_cast<const WarpedMotion&>(source->stepper()).telling().last_residual;
    WarpBalance balance(warp, linear_response(body));
    const SurfaceLoad& load = state.surface.near.load();
    for (int part = 1; part <= 40; ++part) {
      std::vector<double> f(load.forces().begin(), load.forces().end());
      for (double& value : f) value *= part / 40.0;
      balance.find(load.nodes(), f, {.tolerance = 1e-10, .most_rounds = 300});
    }
    std::vector<double> x(u.size());
    warp.displacement(balance.place(), x);
    double largest = 0.0;
    for (std::size_t k = 0; k < x.size(); ++k) {
      largest = std::max(largest, std::abs(x[k]));
      played.off = std::max(played.off, std::abs(x[k] - u[k]));
    }
    played.off /= largest;
  }
  return played;
}

// The study and the tick are of one body: at rest the tick's surface is what WarpBalance finds under the
// tick's forces, and the force on the tool that of the corotational body, bent by the same ball.
TEST(WarpedTick, IsWhatTheStudyFindsAndFeelsLikeTheCorotationalBody) {
  const Model model = test::bent_model(ElementType::quad4);
  const Body warped(warped_model(model), {}, 1, ContactModel::warped), linear{Model(model)};
  const Body live = test::live_session(model, {.solver = LiveLaw::corotational, .mass_damping = 20.0});
  for (const double angle : {10.0, 45.0, 80.0, 120.0}) {
    const Played by_warp = play(warped, angle * degree, 2000, 500),
                 by_live = play(live, angle * degree, 1000, 1000),
                 by_linear = play(linear, angle * degree, 2000, 100);
    std::printf(
        "%g degrees: end face at %.1f, %.1f, %.1f; force %.5g corotational, warped %+.2f %%, linear %+.2f "
        "%%; off %.1e; "
        "jump %.2g %%\n",
        angle, by_live.angle / degree, by_warp.angle / degree, by_linear.angle / degree, by_live.force,
        100 * (by_warp.force / by_live.force - 1), 100 * (by_linear.force / by_live.force - 1), by_warp.off,
        100 * by_warp.largest_jump / by_warp.force);
    EXPECT_LT(by_warp.residual, 1e-6);
    if (angle < 100.0) {  // beyond it dead forces that grow from nothing lead to another place of rest
      EXPECT_LT(by_warp.off, 1e-4);
    }
    EXPECT_NEAR(by_warp.force / by_live.force, 1.0, 0.05);
    EXPECT_NEAR(by_warp.angle / by_live.angle, 1.0, 0.02);
  }
}

TEST(WarpedTick, TwoRunsAreEqual) {
  const Model model = test::bent_model(ElementType::quad4);
  const Body body(warped_model(model), {}, 1, ContactModel::warped);
  const Played one = play(body, 60.0 * degree, 300, 50), other = play(body, 60.0 * degree, 300, 50);
  EXPECT_EQ(one.force, other.force);
  EXPECT_EQ(one.largest_jump, other.largest_jump);
}

}  // namespace
}  // namespace palpate::warped_tick_test
