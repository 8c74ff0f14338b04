// Tools that move without sense for a million ticks in all.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::contact_walk_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

// A tenth under a sanitizer or a debugger.
#if !defined(NDEBUG) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int all_ticks = 100000;
#else
constexpr int all_ticks = 1000000;
#endif

struct WalkCase {
  std::string name;
  int dimension;
  bool inside_out;
  Index max_contacts;
  std::vector<Tool> tools;
};

std::vector<WalkCase> walk_cases() {
  const Tool plain{.radius = 0.15};
  const Tool point{.reach = 0.3};
  const Tool rough{.radius = 0.3, .max_force = 0.05, .friction = 0.5};
  const Tool finger{
      .radius = 0.1, .length = 0.6, .coupling_stiffness = 0.5, .coupling_torsion = 0.02, .friction = 0.3};
  const Tool needle{.length = 0.5, .reach = 0.1};
  const Tool huge{.radius = 1e3};
  const Tool tiny{.radius = 1e-9, .max_force = 1e-3, .friction = 3.0};
  const Tool soft{.radius = 0.2, .coupling_stiffness = 1e-9, .coupling_torsion = 1e-12, .friction = 0.2};
  const Tool raw{.radius = 0.2, .max_force = 1.0, .hand_over = infinity, .reach = 10.0, .friction = 0.3};
  std::vector<WalkCase> cases;
  for (const int dimension : {2, 3}) {
    const auto add = [&](const char* name, Index max_contacts, std::vector<Tool> tools,
                         bool inside_out = false) {
      cases.push_back({std::string(name) + (dimension == 2 ? "InThePlane" : ""), dimension, inside_out,
                       max_contacts, std::move(tools)});
    };
    add("Sphere", 32, {plain});
    add("Point", 32, {point});
    add("RoughSphere", 32, {rough});
    add("Capsule", 32, {finger});
    add("OneContact", 1, {raw});
    add("FourContacts", 4, {finger, rough});
    add("ThreeTools", 32, {plain, needle, raw});
    add("HugeAndTiny", 32, {huge, tiny});
    add("Soft", 32, {soft, point});
    add("InsideOut", 32, {rough, point}, true);
  }
  return cases;
}

Model walk_model(const WalkCase& c) {
  Model model = test::unit_model(c.dimension, 3, Scope::surface, Precision::double_precision);
  model.materials[0].friction = 0.1;
  const auto d = static_cast<std::size_t>(c.dimension);
  for (std::size_t at = 0; c.inside_out && at < model.surface.size(); at += d)
    std::swap(model.surface[at], model.surface[at + 1]);
  return model;
}

/// Where nobody in his senses would put a tool.
class Insanity {
 public:
  explicit Insanity(unsigned seed) : random_(seed) {}

  ToolPose next(const ToolPose& last) {
    ToolPose pose = last;
    if (!pose.position.allFinite()) pose.position.setZero();
    if (one_in(40)) pose.grab = !pose.grab;
    if (one_in(20)) pose.orientation = Eigen::Quaterniond(number(), number(), number(), number());
    const int kind = std::uniform_int_distribution<int>(0, 99)(random_);
    if (kind < 60) {
      pose.position += 0.02 * vector();
    } else if (kind < 80) {
      pose.position += 0.2 * vector();
    } else if (kind < 90) {
      pose.position = Vec3(0.5, 0.5, 0.5) + 0.8 * vector();
    } else if (kind < 94) {
      pose.position = std::pow(10.0, 3.0 * number()) * vector();
    } else if (kind < 96) {
      constexpr std::array<double, 4> sizes = {1e30, 1e160, 1e300, 1.7e308};
      pose.position = sizes[std::uniform_int_distribution<std::size_t>(0, 3)(random_)] * vector();
    } else {
      spoil(pose);
    }
    return pose;
  }

 private:
  void spoil(ToolPose& pose) {
    constexpr std::array<double, 3> values = {nan, infinity, -infinity};
    const double bad = values[std::uniform_int_distribution<std::size_t>(0, 2)(random_)];
    const auto axis = std::uniform_int_distribution<Eigen::Index>(0, 3)(random_);
    switch (std::uniform_int_distribution<int>(0, 3)(random_)) {
      case 0:
        pose.position[axis % 3] = bad;
        break;
      case 1:
        pose.orientation.coeffs()[axis] = bad;
        break;
      case 2:
        pose.orientation.coeffs().setZero();
        break;
      default:
        pose.orientation.coeffs() *= 1e200;
        break;
    }
  }
  bool one_in(int count) { return std::uniform_int_distribution<int>(1, count)(random_) == 1; }
  double number() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  Vec3 vector() { return {number(), number(), number()}; }

  std::mt19937 random_;
};

bool all_finite(const Wrench& wrench) {
  return wrench.force.allFinite() && wrench.torque.allFinite();
}
bool all_finite(const ToolPose& pose) {
  return pose.position.allFinite() && pose.orientation.coeffs().allFinite();
}
bool all_finite(const ToolState& tool) {
  return all_finite(tool.wrench) && all_finite(tool.contact_wrench) && all_finite(tool.pose) &&
         all_finite(tool.device) && tool.local.force.allFinite() && tool.local.stiffness.allFinite() &&
         tool.local.point.allFinite() && !std::isnan(tool.local.radius) && tool.local.radius >= 0.0;
}
bool all_finite(const ContactPoint& contact) {
  return contact.position.allFinite() && contact.arm.allFinite() && contact.frame.allFinite() &&
         contact.force.allFinite() && std::isfinite(contact.gap) && std::isfinite(contact.free_gap);
}

class RandomWalk : public testing::TestWithParam<WalkCase> {
 protected:
  RandomWalk() {
    poses_.resize(GetParam().tools.size());
    for (std::size_t k = 0; k < poses_.size(); ++k) poses_[k].position = above(k, 0.5);
  }

  static Vec3 at(double x, double y, double z) { return test::upright(GetParam().dimension, x, y, z); }
  /// Of the middle of the top; the capsules stand on their end.
  Vec3 above(std::size_t tool, double gap) const {
    const Tool& t = GetParam().tools[tool];
    return at(0.4, 0.45, 1.0 + t.radius + gap);
  }
  Vec3 away(std::size_t tool) const {
    return at(0.4 + 10.0 * static_cast<double>(tool), 0.45, 10.0 + 3.0 * GetParam().tools[tool].radius);
  }

  void walk(int ticks, unsigned seed) {
    Insanity insanity(seed);
    for (int k = 0; k < ticks; ++k) {
      for (ToolPose& pose : poses_) pose = insanity.next(pose);
      step(body_, state_, poses_);
      check(k % 97 == 0);
      if (HasFatalFailure()) return;
    }
  }

  void check(bool surface_too) {
    for (const ToolState& tool : state_.tools) {
      ASSERT_TRUE(all_finite(tool)) << "tick " << state_.ticks;
      ASSERT_LE(tool.wrench.force.norm(), tool.tool.max_force * (1.0 + 1e-12)) << "tick " << state_.ticks;
    }
    ASSERT_LE(state_.contact_count, GetParam().max_contacts);
    for (const ContactPoint& contact : state_.contacts())
      ASSERT_TRUE(all_finite(contact)) << "tick " << state_.ticks;
    if (!surface_too) return;
    surface_displacement(body_, state_, u_);
    for (const double u : u_) ASSERT_TRUE(std::isfinite(u)) << "tick " << state_.ticks;
    for (Index node = 0; node < static_cast<Index>(body_.surface_rest_positions().size()); ++node)
      ASSERT_TRUE(state_.surface.tree.position(node).allFinite()) << "tick " << state_.ticks;
  }

  /// All tools go away and nothing is left of what they did.
  void calm_down() {
    for (std::size_t k = 0; k < poses_.size(); ++k) poses_[k] = test::pose(away(k));
    for (int k = 0; k < 200; ++k) step(body_, state_, poses_);
    for (const ToolState& tool : state_.tools) {
      ASSERT_EQ(tool.wrench.force, Vec3::Zero());
      ASSERT_EQ(tool.wrench.torque, Vec3::Zero());
      ASSERT_EQ(tool.contacts, 0);
    }
    ASSERT_TRUE(state_.surface.near.load().nodes().empty());
  }

  /// Presses the first tool in and comes back: the force there.
  Vec3 touch(State& state) const {
    std::vector<ToolPose> poses = poses_;
    const double depth = 0.02;
    step(body_, state, poses);
    for (int k = 0; k <= 40; ++k) {
      poses[0].position = above(0, 0.02 - (0.02 + depth) * k / 40);
      step(body_, state, poses);
    }
    for (int k = 0; k < 300; ++k) step(body_, state, poses);
    Vec3 force = state.tools[0].contact_wrench.force;
    poses[0].position = away(0);
    for (int k = 0; k < 200; ++k) step(body_, state, poses);
    return force;
  }

  Body body_{walk_model(GetParam())};
  State state_{body_, {.tools = GetParam().tools, .max_contacts = GetParam().max_contacts}};
  std::vector<ToolPose> poses_;
  std::vector<double> u_ = std::vector<double>(static_cast<std::size_t>(body_.greens().order()));
};
INSTANTIATE_TEST_SUITE_P(Tools, RandomWalk, testing::ValuesIn(walk_cases()),
                         [](const testing::TestParamInfo<WalkCase>& tested) { return tested.param.name; });

TEST_P(RandomWalk, NothingBreaksAndTheStateRecovers) {
  const int rounds = 10;
  const int ticks = all_ticks / rounds / static_cast<int>(walk_cases().size());
  for (int round = 0; round < rounds; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    walk(ticks, static_cast<unsigned>(round));
    ASSERT_FALSE(HasFatalFailure());
    calm_down();
    ASSERT_FALSE(HasFatalFailure());
    State fresh(body_, {.tools = GetParam().tools, .max_contacts = GetParam().max_contacts});
    const Vec3 expected = touch(fresh);
    const Vec3 force = touch(state_);

    EXPECT_LE((force - expected).norm(), 1e-6 * expected.norm());
    EXPECT_EQ(GetParam().inside_out, expected.norm() == 0.0);
  }
}

}  // namespace
}  // namespace palpate::contact_walk_test
