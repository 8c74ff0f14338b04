// Let go, and touch again what moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/vectors.h"
#include "runtime/background/motion_source.h"
#include "runtime/body/patch_maker.h"
#include "tests/support/bodies/dynamics_sample.h"
#include "tests/support/runtime_tool.h"

namespace palpate::dynamics_free_motion_test {
namespace {

using Eigen::VectorXd;
using test::pose;

/// A loop that steps packed dynamics between its ticks.
class Loop {
 public:
  Loop(Model model, const Tool& tool, ContactModel contact = ContactModel::quasi_static, int refinement = 1)
      : body(std::move(model), {}, refinement, contact), state(body, {.tools = {tool}, .tick = test::tick}) {
    if (body.model().dynamics.method == DynamicsMethod::packed)
      source.emplace(body, state, MotionSourceOptions{.in_background = false, .jobs = 1});
  }
  void step(const ToolPose& at) {
    if (source) source->receive(state);
    palpate::step(body, state, at);
    if (source) source->post(state);
  }
  Vec3 surface(Index node) const { return state.surface.tree.position(node); }

  Body body;
  State state;
  std::optional<MotionSource> source;
};

struct ReleaseCase {
  const char* name;
  ElementType element;
  bool packed;
  int ticks_per_step;
};

class Release : public testing::TestWithParam<ReleaseCase> {
 protected:
  Release()
      : options_(GetParam().packed ? test::packed() : test::all_modes()),
        d_(traits(GetParam().element).dimension) {
    options_.newmark.time_step = test::tick * GetParam().ticks_per_step;
  }
  Model model() const { return test::swinging_model(GetParam().element, options_); }
  /// Grabs the middle of the top and takes it to `by` in 200 ticks, then waits for `rest` ticks.
  void pull(Loop& loop, const Vec3& by, int rest) {
    const Vec3 top = test::top_middle(d_);
    const Vec3 above = top + 0.01 * test::upright(d_, 0.0, 0.0, 1.0);
    loop.step(pose(above));
    for (int k = 0; k <= 200; ++k) loop.step(pose(above + by * (k / 200.0), true));
    for (int k = 0; k < rest; ++k) loop.step(pose(above + by, true));
    last_ = above + by;
  }

  DynamicsOptions options_;
  int d_;
  Vec3 last_;
  const Tool tool_ = test::plain({.reach = 0.5});
};

/// With a step of the dynamics in each tick.
class ReleaseInEachTick : public Release {};

TEST_P(Release, GoesOnAsTheSparseRouteDoes) {
  Loop loop(model(), tool_);
  pull(loop, test::upright(d_, 0.05, 0.02, 0.04), 20);
  const VectorXd held = test::displacement(loop.body, loop.state);
  ASSERT_GT(held.norm(), 0.03);
  ASSERT_FALSE(loop.state.surface.motion.active());
  const test::SparseRoute sparse(model());
  test::NewmarkIntegrator reference = sparse.start(held, VectorXd::Zero(held.size()));

  const Vec3 far = last_ + test::upright(d_, 0.0, 0.0, 1.0);
  loop.step(pose(far));
  EXPECT_EQ(loop.state.surface.near.load().count, 0);
  EXPECT_LT((test::displacement(loop.body, loop.state) - held).norm(), 1e-12 * held.norm())
      << "it stays in the tick";
  const int m = GetParam().ticks_per_step;
  int ticks = 0;
  while ((test::displacement(loop.body, loop.state) - held).norm() < 1e-12 * held.norm() && ticks < 5 * m) {
    loop.step(pose(far));  // until the next step of the dynamics begins
    ++ticks;
  }
  VectorXd before = held;
  double largest = 0.0;
  for (int k = 0; k < 400; ++k) {
    reference.step();
    const VectorXd after = sparse.to_stored(reference.u());
    for (int j = 1; j <= m; ++j) {
      const VectorXd expected = before + (after - before) * j / m;
      largest = std::max(largest, (test::displacement(loop.body, loop.state) - expected).norm());
      loop.step(pose(far));
    }
    before = after;
  }
  EXPECT_LT(largest, 1e-8 * held.norm());
}

// A hand that moves as it lets go throws the body.
TEST_P(Release, TakesTheVelocityFromTheContact) {
  Loop loop(model(), tool_);
  const Vec3 by = test::upright(d_, 0.05, 0.02, 0.04);
  pull(loop, by, 0);  // moves by / 200 a tick
  const VectorXd held = test::displacement(loop.body, loop.state);
  const VectorXd velocity = held / 200.0 / test::tick;  // it grows in proportion
  const test::SparseRoute sparse(model());
  test::NewmarkIntegrator reference = sparse.start(held, velocity);
  const Vec3 far = last_ + test::upright(d_, 0.0, 0.0, 1.0);
  loop.step(pose(far));
  int waited = 0;
  while ((test::displacement(loop.body, loop.state) - held).norm() < 1e-12 * held.norm() && waited++ < 20)
    loop.step(pose(far));
  for (int j = 1; j < GetParam().ticks_per_step; ++j) loop.step(pose(far));
  reference.step();
  const VectorXd expected = sparse.to_stored(reference.u());
  EXPECT_LT((test::displacement(loop.body, loop.state) - expected).norm(), 1e-6 * (expected - held).norm());
}

// A touch that is shorter than the time over which velocities are taken knows nothing of the one before.
TEST_P(ReleaseInEachTick, ForgetsTheTouchBefore) {
  const auto press = [&](bool before) {
    Loop loop(model(), tool_);
    FreeMotion& motion = loop.state.surface.motion;
    const Greens& greens = loop.body.greens();
    std::vector<double> u(static_cast<std::size_t>(greens.order()));
    SurfaceLoad none(loop.body, 0, 8, 0), load(loop.body, 0, 8, 0), far(loop.body, 0, 8, 0);
    const std::vector<double> f = {1e-3, -2e-3, 0.5e-3}, large = {1.0, 1.0, 1.0};
    load.add(3, f.data());
    far.add(1, large.data());
    const auto tick = [&](const SurfaceLoad& with, bool let_go) {
      if (loop.source) loop.source->receive(loop.state);
      motion.begin_tick(loop.body);
      if (let_go) motion.let_go(loop.body, with, u, false);
      motion.end_tick(loop.body, with);
    };
    if (before) {
      for (int k = 0; k < 20; ++k) tick(far, false);
      tick(none, true);  // u is zero: only its velocity and energy are gone with it
    }
    for (int k = 0; k < 3; ++k) tick(load, false);
    greens.displacement(load.nodes(), load.forces(), u);
    tick(none, true);
    for (int k = 0; k < 5; ++k) tick(none, false);
    VectorXd shown(greens.order());
    for (Index node = 0; node < greens.nodes(); ++node)
      shown.segment(d_ * node, d_) = motion.displacement(loop.body, node).head(d_);
    return shown;
  };
  const auto alone_before = [&] {  // the first touch without the second
    Loop loop(model(), tool_);
    FreeMotion& motion = loop.state.surface.motion;
    std::vector<double> u(static_cast<std::size_t>(loop.body.greens().order()));
    SurfaceLoad none(loop.body, 0, 8, 0), far(loop.body, 0, 8, 0);
    const std::vector<double> large = {1.0, 1.0, 1.0};
    far.add(1, large.data());
    for (int k = 0; k < 30; ++k) {
      if (loop.source) loop.source->receive(loop.state);
      motion.begin_tick(loop.body);
      if (k == 20) motion.let_go(loop.body, none, u, false);
      motion.end_tick(loop.body, k < 20 ? far : none);
    }
    VectorXd shown(loop.body.greens().order());
    for (Index node = 0; node < loop.body.greens().nodes(); ++node)
      shown.segment(d_ * node, d_) = motion.displacement(loop.body, node).head(d_);
    return shown;
  };
  const double left = std::exp(-3.0 * test::tick / 0.1);  // what three ticks of contact leave of the first
  const VectorXd expected = press(false) + left * alone_before();
  EXPECT_LT((press(true) - expected).norm(), 1e-9 * expected.norm());
}

// By superposition, also while it still moves from the last time.
TEST_P(Release, AddsToWhatMoves) {
  Loop loop(model(), tool_);
  const Greens& greens = loop.body.greens();
  const auto n = static_cast<std::size_t>(greens.order());
  const test::SparseRoute sparse(model());
  FreeMotion& motion = loop.state.surface.motion;
  SurfaceLoad none(loop.body, 0, 8, 0), first(loop.body, 0, 8, 0), second(loop.body, 0, 8, 0);
  const std::vector<double> f = {1e-3, -2e-3, 0.5e-3};
  first.add(3, f.data());
  second.add(1, f.data());
  second.add(4, f.data());
  const VectorXd still = VectorXd::Zero(greens.order());
  std::optional<test::NewmarkIntegrator> alone[2];
  const int m = GetParam().ticks_per_step;
  // Loads that were there for as long as velocities are taken over, then are gone.
  const auto press_and_let_go = [&](const SurfaceLoad& load, std::size_t which) {
    std::vector<double> u(n);
    greens.displacement(load.nodes(), load.forces(), u);
    const VectorXd before = Eigen::Map<const VectorXd>(u.data(), greens.order());
    for (int k = 0; k < 3 * m * 4; ++k) {
      if (loop.source) loop.source->receive(loop.state);
      motion.begin_tick(loop.body);
      motion.end_tick(loop.body, load);
      if (k % m == 0 && alone[0]) alone[0]->step();
    }
    if (loop.source) loop.source->receive(loop.state);
    motion.begin_tick(loop.body);
    motion.let_go(loop.body, none, u, false);
    EXPECT_EQ(Eigen::Map<const VectorXd>(u.data(), greens.order()).norm(), 0.0);
    motion.end_tick(loop.body, none);
    for (int k = 1; k < m && alone[0]; ++k) {  // to the end of the step, which the first one begins
      if (loop.source) loop.source->receive(loop.state);
      motion.begin_tick(loop.body);
      motion.end_tick(loop.body, none);
    }
    if (alone[0]) alone[0]->step();
    alone[which].emplace(sparse.equation, sparse.newmark, sparse.from_stored(before),
                         sparse.from_stored(still));
  };
  press_and_let_go(first, 0);
  press_and_let_go(second, 1);
  const double left = std::exp(-12.0 * m * test::tick / 0.1);  // what the second touch leaves of the first
  double largest = 0.0, size = 0.0;
  for (int k = 0; k < 200; ++k) {
    for (int j = 0; j < m; ++j) {
      if (loop.source) loop.source->receive(loop.state);
      motion.begin_tick(loop.body);
      motion.end_tick(loop.body, none);
    }
    for (auto& integrator : alone) integrator->step();
    const VectorXd expected = sparse.to_stored(left * alone[0]->u() + alone[1]->u());
    VectorXd shown(greens.order());
    for (Index node = 0; node < greens.nodes(); ++node)
      shown.segment(d_ * node, d_) = motion.displacement(loop.body, node).head(d_);
    size = std::max(size, expected.norm());
    largest = std::max(largest, (shown - expected).norm());
  }
  EXPECT_GT(size, 0.0);
  EXPECT_LT(largest, 1e-8 * size);
}

// Where the surface is in the tick of a release is what the body's displacement says, also while it still
// moves from the last time: the nodes that the tick has asked for by then have moved.
TEST_P(Release, MovesTheSurfaceThatTheTickHasAskedFor) {
  Loop loop(model(), tool_);
  const Body& body = loop.body;
  FreeMotion& motion = loop.state.surface.motion;
  SurfaceLoad none(loop.body, 0, 8, 0), load(loop.body, 0, 8, 0);
  const std::vector<double> f = {1e-3, -2e-3, 0.5e-3};
  load.add(3, f.data());
  std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
  for (int touch = 0; touch < 3; ++touch) {
    const auto tick = [&](const SurfaceLoad& with) {
      if (loop.source) loop.source->receive(loop.state);
      motion.begin_tick(body);
      motion.end_tick(body, with);
      if (loop.source) loop.source->post(loop.state);
    };
    for (int k = 0; k < 20; ++k) tick(load);
    if (loop.source) loop.source->receive(loop.state);
    motion.begin_tick(body);
    const Index nodes = static_cast<Index>(body.surface_rest_positions().size());
    std::vector<Vec3> before;
    for (Index node = 0; node < nodes; ++node) before.push_back(motion.at(body, node));
    body.greens().displacement(load.nodes(), load.forces(), u);
    const std::vector<double> gone = u;
    motion.let_go(body, none, u, false);
    double moved = 0.0;
    for (Index node = 0; node < nodes; ++node) {
      const SurfaceParts parts = body.surface_parts(node);
      Vec3 expected = Vec3::Zero();
      for (std::size_t k = 0; k < parts.stored.size(); ++k)
        expected += parts.weights[k] * vector_at(gone, d_, parts.stored[k]);
      moved = std::max(moved, expected.norm());
      const Vec3 change = motion.at(body, node) - before[static_cast<std::size_t>(node)];
      EXPECT_LT((change - expected).norm(), 1e-12) << "touch " << touch << ", surface node " << node;
    }
    EXPECT_GT(moved, 1e-3);
    motion.end_tick(body, none);
    if (loop.source) loop.source->post(loop.state);
    for (int k = 0; k < 30; ++k) tick(none);
  }
}

// However far it was taken, and though another tool goes on touching the body.
TEST_P(ReleaseInEachTick, GoesOnFromFarAwayBesideAnotherTool) {
  const Body body(model());
  State state(body, {.tools = {tool_, test::plain({.radius = 0.1})}});
  std::optional<MotionSource> source;
  if (GetParam().packed) source.emplace(body, state, MotionSourceOptions{.in_background = false, .jobs = 1});
  const Vec3 top = test::top_middle(d_), above = top + 0.01 * test::upright(d_, 0.0, 0.0, 1.0);
  const Vec3 side = test::upright(d_, 1.11, 0.5, 0.4), by = test::upright(d_, 0.2, 0.0, 0.5);
  const auto tick = [&](const Vec3& at, bool grab, const Vec3& beside) {
    if (source) source->receive(state);
    step(body, state, std::array{pose(at, grab), pose(beside)});
    if (source) source->post(state);
    return test::displacement(body, state);
  };
  tick(above, false, side);
  const Vec3 pressed = side - test::upright(d_, 0.02, 0.0, 0.0);
  for (int k = 0; k <= 100; ++k) tick(above, false, side + (pressed - side) * (k / 100.0));
  VectorXd before;
  for (int k = 0; k <= 400; ++k) before = tick(above + by * (std::min(k, 380) / 380.0), true, pressed);
  ASSERT_GT(before.lpNorm<Eigen::Infinity>(), 0.4);
  const VectorXd now = tick(above + by, false, pressed);
  ASSERT_TRUE(d_ == 2 || state.surface.near.load().count > 0);
  EXPECT_EQ(state.tools[0].contact_wrench.force.norm(), 0.0) << "all of it is let go";
  EXPECT_LT((now - before).norm(), 1e-3 * before.norm());  // the other tool's contact still settles
}

// All of the surface, where the tree has it.
TEST_P(Release, LeavesTheSurfaceWhereItIs) {
  Loop loop(model(), tool_);
  pull(loop, test::upright(d_, 0.05, 0.02, 0.04), 20);
  const Vec3 far = last_ + test::upright(d_, 0.0, 0.0, 1.0);
  std::vector<Vec3> held;
  for (Index node = 0; node < std::ssize(loop.body.surface_rest_positions()); ++node)
    held.push_back(loop.surface(node));
  loop.step(pose(far));
  double jump = 0.0;
  for (std::size_t node = 0; node < held.size(); ++node)
    jump = std::max(jump, (loop.surface(static_cast<Index>(node)) - held[node]).norm());
  EXPECT_LT(jump, 1e-12);
}

const ReleaseCase each_tick[] = {{"PackedTet4", ElementType::tet4, true, 1},
                                 {"ModalTet4", ElementType::tet4, false, 1},
                                 {"PackedQuad4", ElementType::quad4, true, 1},
                                 {"ModalQuad4", ElementType::quad4, false, 1}};
const ReleaseCase each_fourth_tick[] = {{"PackedSlowTet4", ElementType::tet4, true, 4},
                                        {"ModalSlowTet4", ElementType::tet4, false, 4}};
std::string name_of(const testing::TestParamInfo<ReleaseCase>& tested) {
  return tested.param.name;
}

INSTANTIATE_TEST_SUITE_P(Bodies, Release, testing::ValuesIn(each_tick), name_of);
INSTANTIATE_TEST_SUITE_P(SlowBodies, Release, testing::ValuesIn(each_fourth_tick), name_of);
INSTANTIATE_TEST_SUITE_P(Bodies, ReleaseInEachTick, testing::ValuesIn(each_tick), name_of);

// The overlay's part of the contact goes with the contact: what swings is the body's own mesh, from where it
// was.
TEST(OverlayRelease, IsFoldedBackIntoTheBody) {
  for (const bool is_packed : {true, false}) {
    const Model model =
        test::swinging_model(ElementType::tet4, is_packed ? test::packed() : test::all_modes());
    const Body body(model, {}, 2);
    const Tool tool = test::plain({.reach = 0.5});
    State state(body, {.tools = {tool}, .patch_nodes = patch_room(body, 1, 1)});
    std::optional<MotionSource> source;
    if (is_packed) source.emplace(body, state, MotionSourceOptions{.in_background = false, .jobs = 1});
    const Vec3 top = test::top_middle(3), above = top + Vec3(0.0, 0.0, 0.01), far(0.5, 0.5, 3.0);
    PatchMaker maker(body, 1);
    const Index centre = body.nearest_surface_node(top).node;
    state.surface.patch = maker.make({&centre, 1});
    const auto tick = [&](const ToolPose& at) {
      if (source) source->receive(state);
      step(body, state, at);
      if (source) source->post(state);
    };
    tick(pose(above));
    for (int k = 0; k <= 200; ++k) tick(pose(above + Vec3(0.02, 0.0, 0.04) * (k / 200.0), true));
    for (int k = 0; k < 50; ++k) tick(pose(above + Vec3(0.02, 0.0, 0.04), true));
    ASSERT_GT(state.surface.near.load().patch_count, 0);
    const VectorXd held = test::displacement(body, state);
    const test::SparseRoute sparse(model);
    test::NewmarkIntegrator reference = sparse.start(held, VectorXd::Zero(held.size()));
    tick(pose(far));
    EXPECT_LT((test::displacement(body, state) - held).norm(), 1e-9 * held.norm());
    double largest = 0.0;
    for (int k = 0; k < 300; ++k) {
      tick(pose(far));
      reference.step();
      largest = std::max(largest, (test::displacement(body, state) - sparse.to_stored(reference.u())).norm());
    }
    EXPECT_LT(largest, 1e-8 * held.norm()) << (is_packed ? "packed" : "modal");
    // Fine nodes follow the body's.
    std::vector<double> stored(static_cast<std::size_t>(body.greens().order()));
    std::vector<Vec3> u(body.surface_rest_positions().size());
    MotionSnapshot shown(body);
    state.surface.motion.snapshot(shown);
    surface_displacement(body, state.surface.near.load(), stored, u, &shown);
    for (std::size_t node = 0; node < u.size(); ++node) {
      const SurfaceParts parts = body.surface_parts(static_cast<Index>(node));
      Vec3 expected = Vec3::Zero();
      for (std::size_t k = 0; k < parts.stored.size(); ++k)
        expected += parts.weights[k] * state.surface.motion.displacement(body, parts.stored[k]);
      ASSERT_LT((u[node] - expected).norm(), 1e-12);
    }
  }
}

/// A cube with a few modes only.
Model few_modes(Index count) {
  DynamicsOptions options = test::all_modes();
  options.modes = count;
  return test::swinging_model(ElementType::tet4, options);
}

// What the modes do not carry stays in the tick of the release and fades.
TEST(FewModes, LoseNothingAtOnce) {
  Loop loop(few_modes(6), test::plain({.reach = 0.5}));
  const Vec3 top = test::top_middle(3), above = top + Vec3(0.0, 0.0, 0.01);
  for (int k = 0; k <= 200; ++k) loop.step(pose(above + Vec3(0.0, 0.0, 0.05 * k / 200.0), k > 0));
  for (int k = 0; k < 50; ++k) loop.step(pose(above + Vec3(0.0, 0.0, 0.05), true));
  const VectorXd held = test::displacement(loop.body, loop.state);
  const Vec3 far(0.5, 0.5, 3.0);
  loop.step(pose(far));
  EXPECT_LT((test::displacement(loop.body, loop.state) - held).norm(), 1e-12 * held.norm());
  VectorXd before = held;
  for (int k = 0; k < 500; ++k) {
    loop.step(pose(far));
    const VectorXd now = test::displacement(loop.body, loop.state);
    ASSERT_LT((now - before).norm(), 0.25 * held.norm()) << k;
    before = now;
  }
  // Then only the modes are left.
  VectorXd residual = before;
  const Modes& modes = *loop.body.modes();
  Eigen::MatrixXd Phi(residual.size(), modes.count());
  for (Eigen::Index dof = 0; dof < residual.size(); ++dof)
    Phi.row(dof) = Eigen::Map<const Eigen::RowVectorXd>(modes.row(dof), modes.count());
  residual -= Phi * Phi.colPivHouseholderQr().solve(residual);
  EXPECT_LT(residual.norm(), 1e-6 * held.norm());
}

// In closed form: the modes by Newmark from where the contact held them, and (1 + omega t) e^(-omega t) of
// the rest, both from the same moment on.
TEST(FewModes, FadeTheRestInStepWithTheModes) {
  for (const int ticks_per_step : {1, 4}) {
    DynamicsOptions options = test::all_modes();
    options.modes = 6;
    options.newmark.time_step = ticks_per_step * test::tick;
    Loop loop(test::swinging_model(ElementType::tet4, options), test::plain({.reach = 0.5}));
    const Vec3 top = test::top_middle(3), above = top + Vec3(0.0, 0.0, 0.01), far(0.5, 0.5, 3.0);
    for (int k = 0; k <= 200; ++k) loop.step(pose(above + Vec3(0.0, 0.0, 0.05 * k / 200.0), k > 0));
    for (int k = 0; k < 50; ++k) loop.step(pose(above + Vec3(0.0, 0.0, 0.05), true));
    const VectorXd held = test::displacement(loop.body, loop.state);
    const Modes& modes = *loop.body.modes();
    const std::span<const double> omega = modes.omega();
    std::vector<double> g(omega.size()), rate(omega.size());
    const SurfaceLoad& load = loop.state.surface.near.load();
    modes.add_projection(load.nodes(), load.forces(), 1.0, g);
    ModalNewmark reference(omega, options.damping, options.newmark);
    reference.let_go(g, rate);
    Eigen::MatrixXd Phi(held.size(), modes.count());
    for (Eigen::Index dof = 0; dof < held.size(); ++dof)
      Phi.row(dof) = Eigen::Map<const Eigen::RowVectorXd>(modes.row(dof), modes.count());
    const auto by_modes = [&] {
      return VectorXd(Phi * Eigen::Map<const VectorXd>(reference.q().data(), modes.count()));
    };
    VectorXd before = by_modes();
    const VectorXd rest = held - before;
    ASSERT_GT(rest.norm(), 0.1 * held.norm());

    loop.step(pose(far));
    for (int k = 0; k < 5 && (test::displacement(loop.body, loop.state) - held).norm() < 1e-9 * held.norm();
         ++k)
      loop.step(pose(far));
    for (int k = 0; k < 100; ++k) {
      reference.predict();
      reference.advance();
      const VectorXd after = by_modes();
      for (int j = 1; j <= ticks_per_step; ++j) {
        const double angle = modes.first_dropped_omega() * (k * ticks_per_step + j) * test::tick;
        const VectorXd expected =
            before + (after - before) * j / ticks_per_step + (1.0 + angle) * std::exp(-angle) * rest;
        ASSERT_LT((test::displacement(loop.body, loop.state) - expected).norm(), 1e-5 * held.norm())
            << ticks_per_step << ' ' << k << ' ' << j;
        loop.step(pose(far));
      }
      before = after;
    }
  }
}

class TouchAgain : public testing::TestWithParam<bool> {};

// A ball that waits beside a swinging body is struck by it: pushed away, and never inside. The force changes
// from tick to tick by no more than what surface and ball move makes of the stiffness.
TEST_P(TouchAgain, IsContactWithAMovingSurface) {
  DynamicsOptions options = GetParam() ? test::packed() : test::all_modes();
  options.damping = {.mass = 0.0, .stiffness = 2e-3};
  Loop loop(test::swinging_model(ElementType::tet4, options),
            test::plain({.radius = 0.1, .coupling_stiffness = 5.0, .reach = 0.5}));
  const Vec3 above(0.5, 0.5, 1.11);
  loop.step(pose(above));
  for (int k = 0; k <= 300; ++k) loop.step(pose(above - Vec3(0.0, 0.0, 0.09 * k / 300.0), true));
  // Let go of, it comes up; the ball waits a little over the resting surface.
  const Vec3 wait(0.5, 0.5, 1.105);
  double largest = 0.0, last = 0.0;
  int touched = 0, free = 0;
  for (int k = 0; k < 1500; ++k) {
    const double surface = loop.state.surface.tree.nearest(Vec3(0.5, 0.5, 1.1)).nearest.on_simplex.z();
    loop.step(pose(wait));
    const ToolState& tool = loop.state.tools.front();
    ASSERT_FALSE(has(loop.state.status, StepStatus::inside_body)) << k;
    const double force = tool.wrench.force.z();
    if (k == 0) continue;  // let go of in this tick
    ASSERT_GT(force, -1e-9) << k;
    touched += tool.contacts > 0 ? 1 : 0;
    free += tool.contacts == 0 ? 1 : 0;
    const double moved =
        std::abs(loop.state.surface.tree.nearest(Vec3(0.5, 0.5, 1.1)).nearest.on_simplex.z() - surface) +
        std::abs(tool.surface_change.z());
    ASSERT_LE(std::abs(force - last), 5.0 * moved + 1e-9) << k;
    last = force;
    largest = std::max(largest, force);
  }
  EXPECT_GT(touched, 10);
  EXPECT_GT(free, 100);
  EXPECT_GT(largest, 1e-4);
}

// A ball that sticks holds the place that it presses on, however the body swings under it.
TEST_P(TouchAgain, SticksToWhatMoves) {
  DynamicsOptions options = GetParam() ? test::packed() : test::all_modes();
  options.damping = {.mass = 0.0, .stiffness = 2e-3};
  const Body body(test::swinging_model(ElementType::tet4, options));
  const Tool ball = test::plain({.radius = 0.2, .friction = 50.0});
  State state(body, {.tools = {ball, test::plain({.reach = 0.5})}});
  std::optional<MotionSource> source;
  if (GetParam()) source.emplace(body, state, MotionSourceOptions{.in_background = false, .jobs = 1});
  const auto tick = [&](const Vec3& at, const Vec3& hand, bool grab) {
    if (source) source->receive(state);
    step(body, state, std::array{pose(at), pose(hand, grab)});
    if (source) source->post(state);
  };
  const Vec3 over(0.5, 0.5, 1.21), side(1.01, 0.5, 0.6);
  tick(over, side, false);
  for (int k = 0; k <= 200; ++k) tick(over - Vec3(0.0, 0.0, 0.06 * k / 200.0), side, false);
  const Vec3 in = over - Vec3(0.0, 0.0, 0.06);
  for (int k = 0; k <= 200; ++k) tick(in, side + Vec3(0.0, 0.15 * k / 200.0, 0.0), true);
  for (int k = 0; k < 50; ++k) tick(in, side + Vec3(0.0, 0.15, 0.0), true);
  // The place that it is stuck to, wherever the contact points are.
  const auto on_ball = [](const ContactPoint& contact) {
    return contact.tool == 0 && contact.force.norm() > 0.0;
  };
  const auto found = std::find_if(state.contacts().begin(), state.contacts().end(), on_ball);
  ASSERT_NE(found, state.contacts().end());
  const ContactPoint stuck = *found;
  const Vec3 place = test::place_now(state, stuck);
  double swung = 0.0, farthest = 0.0;
  for (int k = 0; k < 60; ++k) {
    tick(in, side + Vec3(1.0, 0.15, 0.0), false);
    ASSERT_GT(state.tools[0].contacts, 0) << k;
    swung = std::max(
        swung,
        std::abs(
            state.surface.motion.at(body, std::max({stuck.nodes[0], stuck.nodes[1], stuck.nodes[2]})).y()));
    farthest = std::max(farthest, std::abs(test::place_now(state, stuck).y() - place.y()));
  }
  EXPECT_GT(swung, 0.01);
  EXPECT_LT(farthest, 0.2 * swung);
}

INSTANTIATE_TEST_SUITE_P(Methods, TouchAgain, testing::Bool(),
                         [](const auto& tested) { return std::string(tested.param ? "Packed" : "Modal"); });

// In the background, in its own time: what comes is the same motion.
TEST(Background, SwingsTheSameBody) {
  const Tool tool = test::plain({.reach = 0.5});
  const Vec3 above(0.5, 0.5, 1.01), far(0.5, 0.5, 3.0);
  const auto run = [&](bool in_background) {
    const Body body(test::swinging_model(ElementType::tet4, test::packed()));
    State state(body, {.tools = {tool}});
    MotionSource source(body, state, {.in_background = in_background, .jobs = 2});
    std::vector<VectorXd> motion;
    for (int k = 0; k < 400; ++k) {
      source.receive(state);
      step(body, state, k < 201 ? pose(above + Vec3(0.0, 0.0, 0.05 * k / 200.0), k > 0) : pose(far));
      source.post(state);
      motion.push_back(test::displacement(body, state));
      if (!in_background || !state.surface.motion.active()) continue;
      const std::int64_t posted = state.surface.motion.job().step;  // wait as a loop in real time would
      while (source.steps() < posted) std::this_thread::yield();
    }
    return motion;
  };
  const std::vector<VectorXd> waited = run(true), alone = run(false);
  for (std::size_t k = 0; k < alone.size(); ++k) ASSERT_EQ(waited[k], alone[k]) << k;
}

// A worker that is late is told of, and the body's time stands still meanwhile.
TEST(Background, IsToldWhenItIsLate) {
  const Body body(test::swinging_model(ElementType::tet4, test::packed()));
  State state(body, {.tools = {test::plain({.reach = 0.5})}});
  const Vec3 above(0.5, 0.5, 1.01);
  for (int k = 0; k < 200; ++k) step(body, state, pose(above + Vec3(0.0, 0.0, 0.05 * k / 200.0), k > 0));
  const VectorXd held = test::displacement(body, state);
  for (int k = 0; k < 5; ++k) step(body, state, pose(Vec3(0.5, 0.5, 3.0)));
  EXPECT_TRUE(has(state.status, StepStatus::late_motion));
  EXPECT_LT((test::displacement(body, state) - held).norm(), 1e-12 * held.norm());
}

TEST(TimeStep, IsAWholeNumberOfTicks) {
  DynamicsOptions options = test::packed();
  options.newmark.time_step = 0.0025;
  const Body body(test::swinging_model(ElementType::tet4, options));
  EXPECT_THROW(State(body, {.tick = 0.001}), Error);
  EXPECT_NO_THROW(State(body, {.tick = 0.0005}));
  EXPECT_NO_THROW(State(body, {.tick = 0.0025}));
  EXPECT_THROW(State(body, {.tick = 0.005}), Error);
  EXPECT_THROW(State(body, {.tick = 0.0}), Error);
  const Body dynamic(test::swinging_model(ElementType::tet4, options), {}, 1, ContactModel::dynamic);
  EXPECT_THROW(State(dynamic, {.tick = 0.0005}), Error);
  EXPECT_NO_THROW(State(dynamic, {.tick = 0.0025}));
}

TEST(WithoutDynamics, NothingSwings) {
  const Body body(test::unit_model(ElementType::tet4, 3, Scope::full, Precision::double_precision));
  State state(body, {.tools = {test::plain({.reach = 0.5})}});
  const Vec3 above(0.5, 0.5, 1.01);
  for (int k = 0; k < 100; ++k) step(body, state, pose(above + Vec3(0.0, 0.0, 0.05 * k / 100.0), k > 0));
  step(body, state, pose(Vec3(0.5, 0.5, 3.0)));
  EXPECT_FALSE(state.surface.motion.active());
  EXPECT_EQ(test::displacement(body, state).norm(), 0.0);
}

}  // namespace
}  // namespace palpate::dynamics_free_motion_test
