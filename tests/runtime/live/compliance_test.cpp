// The compliance by which a tool meets a live body, renewed as the body turns and deforms.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <numeric>

#include "runtime/background/live_motion.h"
#include "runtime/background/motion_source.h"
#include "runtime/core/tick/step.h"
#include "runtime/core/tick/surface_motion.h"
#include "tests/support/bodies/thrown_bodies.h"
#include "tests/support/live_session.h"

namespace palpate::live_compliance_test {
namespace {

std::vector<Index> all_nodes(const Body& body) {
  std::vector<Index> nodes(static_cast<std::size_t>(body.greens().nodes()));
  std::iota(nodes.begin(), nodes.end(), 0);
  return nodes;
}

using Eigen::VectorXd;

constexpr double quarter = 0.5 * std::numbers::pi;

/// What a step's end moves by with a force in it, of the largest part: by W against two steps of the solver.
double error_of(const Greens& W, const Body& body, const LiveState& state) {
  const LiveBody& live = body.live()->body;
  const int d = live.dimension();
  double largest = 0.0, off = 0.0;
  std::vector<double> u(static_cast<std::size_t>(W.order()));
  for (Index stored = 0; stored < W.nodes(); stored += 3) {
    std::vector<double> f = {1e-7, 2e-7, -1e-7};
    f.resize(static_cast<std::size_t>(d));
    W.displacement({&stored, 1}, f, u);
    LiveState without = state, with = state;
    VectorXd push = VectorXd::Zero(live.dofs());
    LiveStepper(live, body.live()->stepper).step(without, push);
    for (int axis = 0; axis < d; ++axis)
      push[d * body.mesh_node(stored) + axis] = f[static_cast<std::size_t>(axis)];
    LiveStepper(live, body.live()->stepper).step(with, push);
    for (Index other = 0; other < W.nodes(); ++other) {
      const Eigen::Index dof = Eigen::Index{d} * body.mesh_node(other);
      for (int axis = 0; axis < d; ++axis) {
        const double moved = with.x[dof + axis] - without.x[dof + axis];
        largest = std::max(largest, std::abs(moved));
        off = std::max(off, std::abs(moved - u[static_cast<std::size_t>(d * other + axis)]));
      }
    }
  }
  return off / largest;
}

/// A press on a body whose solver never answers: all of the force is what standing still made.
TEST(LiveLate, ABodyThatStandsStillIsAnErrorOfTheForce) {
  const Body body = test::live_bar(3, {.solver = LiveLaw::corotational});
  State moves(body, {.tools = {Tool{.radius = 0.005}}}), stands(moves);
  MotionSource source(body, moves, {.in_background = false}), silent(body, stands, {.in_background = false});
  const auto pose = [](int tick) {
    return ToolPose{.position = Vec3(0.06, 0.01, 0.0255 - 2e-5 * std::min(tick, 100))};
  };
  for (int tick = 0; tick < 400; ++tick) {
    source.receive(moves);
    EXPECT_FALSE(has(step(body, moves, pose(tick)), StepStatus::late_motion));
    source.post(moves);
    EXPECT_EQ(moves.tools[0].force_error, 0.0);
    step(body, stands, pose(tick));
    silent.post(stands);
  }
  const ToolState& tool = stands.tools[0];
  EXPECT_TRUE(has(stands.status, StepStatus::late_motion)) << "in each tick, not only where a step ends";
  const double right = moves.tools[0].contact_wrench.force.norm(), felt = tool.contact_wrench.force.norm();
  EXPECT_GT(felt, 2.0 * right) << "it is stiffer than the body";
  EXPECT_GE(tool.force_error, felt - right);
  EXPECT_LE(tool.force_error, felt);
}

TEST(LiveLoad, AllColumnsByThreadsAreThoseInTurn) {
  const Body body = test::live_bar(3, {.solver = LiveLaw::corotational});
  std::vector<Index> nodes;
  for (const Index stored : all_nodes(body)) nodes.push_back(body.mesh_node(stored));
  StepCompliance threads(body.live()->body, body.live()->stepper, nodes), turns = threads;
  const Eigen::VectorXd x = body.live()->body.start();
  ASSERT_TRUE(threads.begin(x, {}) && turns.begin(x, {}));
  threads.find_all(3);
  while (!turns.go_on(64)) {
  }
  const PackedGreens a = threads.take(), b = turns.take();
  for (std::int64_t column = 0; column < a.order(); ++column) {
    for (std::int64_t row = column; row < a.order(); ++row) ASSERT_EQ(a(row, column), b(row, column));
  }
}

class LiveComplianceOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, LiveComplianceOf, testing::Values(2, 3));

// It falls by 20 mm, and is pressed by 1 and by 3 mm where it lies.
TEST_P(LiveComplianceOf, ABodyThatFellIsPressedInFromWhereItLies) {
  const int d = GetParam();
  const Vec3 up = Vec3::Unit(d - 1);
  const Body body = test::live_bar(
      d, {.solver = LiveLaw::corotational, .gravity = -9.81 * up, .free = true, .floor = -0.02});
  State state(body, {.tools = {Tool{.radius = 0.005}}});
  MotionSource source(body, state, {.in_background = false});
  const Vec3 middle(0.04, d == 3 ? 0.01 : 0.02, 0.02);
  const auto away = [&](const Vec3& x) { return (x - middle).head(d).norm(); };
  const auto node = static_cast<Index>(std::ranges::min_element(body.surface_rest_positions(), {}, away) -
                                       body.surface_rest_positions().begin());
  const auto hold = [&](double height, int ticks) {
    Vec3 at = middle;
    at[d - 1] = height;
    if (d == 2) at.z() = 0.0;
    for (int tick = 0; tick < ticks; ++tick) {
      source.receive(state);
      step(body, state, ToolPose{.position = at});
      source.post(state);
    }
  };
  const auto height = [&] { return state.surface.tree.position(node)[d - 1]; };
  hold(0.1, 2000);
  const double top = height();
  EXPECT_NEAR(top, 0.0, 0.002) << "it has landed, and sags a little";
  for (const double by : {0.001, 0.003}) {
    for (double down = 0.0; down < by; down += 2e-5) hold(top + 0.005 - down, 1);
    hold(top + 0.005 - by, 500);
    const Vec3 untouched = body.surface_rest_positions()[static_cast<std::size_t>(node)] +
                           state.surface.motion.untouched(body, node);
    EXPECT_GT(state.tools[0].contacts, 0);
    EXPECT_NEAR(untouched[d - 1] - height(), by, 0.1 * by);
    hold(0.1, 1500);
    EXPECT_NEAR(height(), top, 1e-4) << "let go";
  }
}

TEST_P(LiveComplianceOf, ABodyThatTurnedIsRightAgain) {
  const Body body = test::live_bar(GetParam(), {.solver = LiveLaw::corotational, .free = true});
  LiveState state(body.live()->body);
  const double at_rest = error_of(body.greens(), body, state);
  EXPECT_LT(at_rest, 1e-5);
  const Mat3 R = Eigen::AngleAxisd(quarter, Vec3::UnitZ()).toRotationMatrix();
  test::throw_body(body.live()->body, R, Vec3(0.1, 0, 0), Vec3::Zero(), Vec3::Zero(), state);
  EXPECT_GT(error_of(body.greens(), body, state), 0.1);
  LiveCompliance compliance(body, true);
  for (int k = 0; k < 200 && compliance.renewals() == 0; ++k) compliance.follow(state, 0.0);
  EXPECT_EQ(compliance.renewals(), 1);
  EXPECT_LT(error_of(compliance.now(), body, state), 1e-5);
}

TEST_P(LiveComplianceOf, ABodyThatGoesOnTurningIsTakenWithIt) {
  const Body body = test::live_bar(GetParam(), {.solver = LiveLaw::corotational, .free = true});
  LiveCompliance compliance(body, true), old(body, false);
  LiveState state(body.live()->body);
  const Vec3 axis = GetParam() == 2 ? Vec3(0, 0, 1) : Vec3(Vec3(1, 2, 2) / 3.0);
  for (int k = 0; k < 300; ++k) {
    LiveState now(body.live()->body);
    test::throw_body(body.live()->body, Eigen::AngleAxisd(0.02 * k, axis).toRotationMatrix(), Vec3::Zero(),
                     Vec3::Zero(), Vec3::Zero(), now);
    now.time = 0.005 * k;
    compliance.follow(now, 0.0);
    old.follow(now, 0.0);
    state = now;
  }
  EXPECT_EQ(compliance.renewals(), 1);
  EXPECT_GT(compliance.turns(), 50);
  EXPECT_EQ(old.renewals() + old.turns(), 0);
  EXPECT_GT(error_of(old.now(), body, state), 0.1);
  EXPECT_LT(error_of(compliance.now(), body, state), 0.05);
  compliance.rest();
  EXPECT_EQ(compliance.renewed(), nullptr);
}

/// A bar that forces turn and push, without a tick.
class DrivenBar {
 public:
  DrivenBar(const Body& body, bool renews)
      : body_(body),
        live_(body.live()->body),
        motion_(body, renews),
        u_(static_cast<std::size_t>(body.greens().order())) {}

  /// How far the ends have turned [rad].
  [[nodiscard]] double angle() const {
    const Vec3 along = middle_of(0.08) - middle_of(0.0);
    return std::atan2(along.y(), along.x());
  }
  /// Forces at the ends that take it to an angle, as a spring and a damper would.
  void turn_to(double angle) {
    for (int k = 0; k < 400; ++k) {
      const double now = this->angle(), speed = (now - last_angle_) / 0.005;
      last_angle_ = now;
      const double inertia = live_.mass().sum() / 2.0 * 0.08 * 0.08 / 12.0;
      const double force = inertia * (400.0 * (angle - now) - 40.0 * speed) / 0.08;
      const Vec3 across = force * Vec3(-std::sin(now), std::cos(now), 0.0);
      job_.load.clear();
      put(across, 0.08);
      put(-across, 0.0);
      do_job();
    }
  }
  /// Pushes ever harder on the middle of its long side, along the body's y; the largest error in the force,
  /// of it.
  double push() {
    double largest = 0.0;
    const Vec3 inwards(std::sin(angle()), -std::cos(angle()), 0.0);
    const Index node = body_.nearest_surface_node(Vec3(0.04, 0.02, 0.0)).node;
    for (int k = 1; k <= 10; ++k) {
      const Vec3 f = 0.02 * k * inwards;
      job_.load.clear();
      job_.load.add({&node, 1}, {f.data(), 2}, 1.0);
      do_job();
      if (k > 1) largest = std::max(largest, motion_.telling().last_force_error / (0.02 * k));
    }
    return largest;
  }
  [[nodiscard]] LiveTelling telling() const { return motion_.telling(); }

 private:
  [[nodiscard]] Vec3 middle_of(double end) const {
    Vec3 sum = Vec3::Zero();
    int count = 0;
    for (Index node = 0; node < std::ssize(live_.mesh().nodes); ++node) {
      if (std::abs(live_.mesh().nodes[static_cast<std::size_t>(node)].x() - end) > 1e-9) continue;
      sum += node_part(motion_.state().x, 2, node);
      ++count;
    }
    return sum / count;
  }
  void put(const Vec3& force, double end) {
    std::vector<Index> nodes;
    for (Index stored = 0; stored < body_.greens().nodes(); ++stored) {
      if (std::abs(body_.rest_position(stored).x() - end) < 1e-9) nodes.push_back(stored);
    }
    for (const Index node : nodes) {
      const Vec3 f = force / static_cast<double>(nodes.size());
      job_.load.add({&node, 1}, {f.data(), 2}, 1.0);
    }
  }
  void do_job() {
    ++job_.step;
    motion_.do_job(job_, false, u_);
  }

  const Body& body_;
  const LiveBody& live_;
  LiveMotion motion_;
  MotionJob job_{.release = {NodalLoad(2, 0), NodalLoad(2, 0)}, .load = NodalLoad(2, 100)};
  std::vector<double> u_;
  double last_angle_ = 0.0;
};

TEST(LiveCompliance, MeetsABodyThatTurnedByARightAngleAsAtRest) {
  const Body body = test::live_bar(2, {.solver = LiveLaw::corotational, .mass_damping = 0.0, .free = true});
  DrivenBar resting(body, false), never(body, false), renewed(body, true);
  const double at_rest = resting.push();
  for (DrivenBar* bar : {&never, &renewed}) {
    bar->turn_to(quarter);
    EXPECT_NEAR(bar->angle(), quarter, 0.01);
  }
  const double before = never.push(), after = renewed.push();
  RecordProperty("error_at_rest", std::to_string(at_rest));
  RecordProperty("error_without_renewal", std::to_string(before));
  RecordProperty("error_with_renewal", std::to_string(after));
  std::printf("share of the force: at rest %.4f, turned without renewal %.4f, with %.4f\n", at_rest, before,
              after);
  EXPECT_GT(before, 10.0 * at_rest);
  EXPECT_LT(after, 1.5 * at_rest);
  EXPECT_EQ(never.telling().renewals, 0);
  EXPECT_GT(renewed.telling().renewals, 0);
  EXPECT_LT(renewed.telling().compliance_age, never.telling().compliance_age);
}

// Two calls of the same tick, a change of the compliance between them: what is touched stays where it is.
TEST_P(LiveComplianceOf, ATickChangesWithoutAJump) {
  const Body body = test::live_bar(GetParam(), {.solver = LiveLaw::corotational});
  State state(body, {.tools = {Tool{.radius = 0.006, .reach = 0.01}}});
  MotionSource source(body, state, {.in_background = false});
  const Index greens = static_cast<Index>(body.greens().order());
  std::vector<double> before(static_cast<std::size_t>(greens)), after(before.size());
  std::shared_ptr<const Greens> other;
  {
    LiveCompliance compliance(body, true);
    LiveState bent(body.live()->body);
    for (Eigen::Index dof = 0; dof < bent.x.size(); dof += GetParam())
      bent.x[dof + 1] += 5.0 * std::pow(bent.x[dof], 2);
    for (int k = 0; k < 100; ++k) compliance.follow(bent, 0.0);
    other = compliance.renewed();
  }
  ASSERT_NE(other, nullptr);
  ToolPose pose;
  double force = 0.0;
  for (int k = 0; k < 60; ++k) {
    pose.position = Vec3(0.06, 0.0265 - 0.0001 * k, GetParam() == 3 ? 0.01 : 0.0);
    const std::int64_t last = state.surface.motion.sample_step();
    source.receive(state);
    const bool changes = k == 55;
    if (changes) {
      ASSERT_GT(state.surface.motion.sample_step(), last);
      surface_displacement(body, state, before);
      change_compliance(body, state.surface, other);
      surface_displacement(body, state, after);
      double largest = 0.0, jump = 0.0;
      for (std::size_t dof = 0; dof < before.size(); ++dof) {
        largest = std::max(largest, std::abs(before[dof]));
        jump = std::max(jump, std::abs(after[dof] - before[dof]));
      }
      EXPECT_GT(largest, 1e-3);
      EXPECT_LT(jump, 1e-12 * largest);
      EXPECT_EQ(state.surface.near.load().compliance, other);
    }
    step(body, state, pose);
    source.post(state);
    const double now = state.tools[0].wrench.force.norm();
    if (changes) {
      EXPECT_NEAR(now, force, 0.1 * force);
    }
    force = now;
  }
  EXPECT_GT(force, 0.0);
}

// The steps of a session that came late, and one that was never made.
TEST(LiveReplay, DoesTheStepsThatThereWere) {
  const Body body = test::live_bar(2, {.solver = LiveLaw::corotational});
  const auto play = [&](bool skips) {
    State state(body, {.tools = {Tool{.radius = 0.006, .reach = 0.01}}});
    MotionSource source(body, state, {.in_background = false});
    double forces = 0.0;
    for (int k = 0; k < 100; ++k) {
      const std::int64_t made = std::max(0, k / 5 - 2), step = skips && made == 5 ? 4 : made;
      source.receive(state, step);
      EXPECT_EQ(state.surface.motion.sample_step(), step);
      palpate::step(body, state, {.position = Vec3(0.06, 0.0265 - 0.0001 * k, 0.0)});
      source.post(state);
      forces += state.tools[0].wrench.force.norm();
    }
    EXPECT_EQ(source.steps(), skips ? 16 : 17);
    EXPECT_GT(forces, 0.0);
    return forces;
  };
  EXPECT_EQ(play(false), play(false));
  EXPECT_NE(play(false), play(true));
}

// A Poisson's ratio of the session's is as good as one of the file's: to the last bit.
TEST(LivePoissonsRatio, IsThatOfAFileThatHasIt) {
  for (const int d : {2, 3}) {
    Model model = test::unit_model(d, 2, Scope::surface, Precision::double_precision);
    Model other = model;
    for (Material& material : other.materials) material.poissons_ratio = 0.45;
    const LiveSettings plain{.solver = LiveLaw::corotational},
        changed{.solver = LiveLaw::corotational, .poissons_ratio = 0.45};
    const Body of_file = test::live_session(other, plain), of_session = test::live_session(model, changed),
               before = test::live_session(model, plain);
    EXPECT_EQ(of_session.model().materials[0].poissons_ratio, 0.45);
    double most_changed = 0.0;
    for (std::int64_t j = 0; j < of_file.greens().order(); ++j) {
      std::vector<double> f(static_cast<std::size_t>(of_file.greens().order()), 0.0), a(f), b(f), c(f);
      f[static_cast<std::size_t>(j)] = 1.0;
      const std::vector<Index> all = all_nodes(of_file);
      of_file.greens().displacement(all, f, a);
      of_session.greens().displacement(all, f, b);
      before.greens().displacement(all, f, c);
      EXPECT_EQ(a, b) << j;
      most_changed = std::max(most_changed, std::abs(a[0] - c[0]) / std::abs(c[0]));
    }
    EXPECT_GT(most_changed, 0.01);
  }
}

}  // namespace
}  // namespace palpate::live_compliance_test
