// Contact points that are merged, against contact at each node of the surface: projected Gauss-Seidel sweeps
// in double precision over the dense Green's functions, with none of the tick's detection, merging, near
// field or solvers.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::merging_test {
namespace {

using test::plain;
using test::pose;

constexpr double radius = 2.0;

const Body& cube() {
  static const Body body(test::unit_model(3, 10, Scope::surface, Precision::double_precision));
  return body;
}

/// A sphere of over three edges touches corners alone: its contact at all nodes of the surface.
class EveryNode {
 public:
  EveryNode(const Body& body, double friction) : friction_(friction) {
    for (std::size_t node = 0; node < body.surface_stored_nodes().size(); ++node) {
      const Index stored = body.surface_stored_nodes()[node];
      if (stored < 0) continue;
      stored_.push_back(stored);
      rest_.push_back(body.surface_rest_positions()[node]);
    }
    const auto n = static_cast<Eigen::Index>(stored_.size());
    C_.resize(3 * n, 3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j)
        C_.block<3, 3>(3 * i, 3 * j) =
            body.greens().block(stored_[static_cast<std::size_t>(i)], stored_[static_cast<std::size_t>(j)]);
    }
    u_ = force_ = Eigen::VectorXd::Zero(3 * n);
  }

  /// Force on the sphere after its way to `centre`.
  Vec3 step(const Vec3& centre) {
    const Vec3 way = is_first_ ? Vec3(Vec3::Zero()) : Vec3(centre - centre_);
    is_first_ = false;
    centre_ = centre;
    const Eigen::VectorXd before = u_;
    for (int pass = 0; pass < 3; ++pass) solve(way, before);
    Vec3 sum = Vec3::Zero();
    for (Eigen::Index k = 0; k < force_.size(); k += 3) sum += force_.segment<3>(k);
    return sum;
  }

  /// Nodes that carry force.
  [[nodiscard]] int closed() const {
    int count = 0;
    for (Eigen::Index k = 0; k < force_.size(); k += 3) count += force_.segment<3>(k).isZero(0.0) ? 0 : 1;
    return count;
  }

 private:
  /// Linear about where the nodes are: gaps along the normals there, and what they slide from `before` on.
  void solve(const Vec3& way, const Eigen::VectorXd& before) {
    std::vector<Eigen::Index> near;
    std::vector<Vec3> normal;
    std::vector<double> gap;
    for (std::size_t k = 0; k < rest_.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(3 * k);
      const Vec3 across = centre_ - rest_[k] - u_.segment<3>(at);
      const double distance = across.norm();
      if (distance - radius > 0.02) {
        force_.segment<3>(at).setZero();
        continue;
      }
      near.push_back(at);
      normal.emplace_back(across / distance);
      gap.push_back(distance - radius);
    }
    const auto n = static_cast<Eigen::Index>(near.size());
    Eigen::MatrixXd W(3 * n, 3 * n);
    Eigen::VectorXd lambda(3 * n), r(3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j)
        W.block<3, 3>(3 * i, 3 * j) =
            C_.block<3, 3>(near[static_cast<std::size_t>(i)], near[static_cast<std::size_t>(j)]);
      const auto k = static_cast<std::size_t>(i);
      lambda.segment<3>(3 * i) = force_.segment<3>(near[k]);
      const Vec3 slip = way - (u_ - before).segment<3>(near[k]);
      r.segment<3>(3 * i) = gap[k] * normal[k] + slip - slip.dot(normal[k]) * normal[k];
    }
    for (int sweep = 0; sweep < 3000; ++sweep) {
      double change = 0.0;
      for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3& m = normal[static_cast<std::size_t>(i)];
        const Eigen::Matrix3d own = W.block<3, 3>(3 * i, 3 * i);
        const Vec3 old = lambda.segment<3>(3 * i);
        const Vec3 at = r.segment<3>(3 * i);
        const double along = std::max(0.0, m.dot(old) - m.dot(at) / m.dot(own * m));
        Vec3 across = old - m.dot(old) * m - (at - m.dot(at) * m) / own.trace();
        const double most = friction_ * along;
        if (across.norm() > most) across *= most / across.norm();
        const Vec3 step = along * m + across - old;
        if (step.isZero(0.0)) continue;
        lambda.segment<3>(3 * i) += step;
        r += W.middleCols<3>(3 * i) * step;
        change = std::max(change, step.norm());
      }
      if (change < 1e-7 * lambda.lpNorm<Eigen::Infinity>()) break;
    }
    for (Eigen::Index i = 0; i < n; ++i)
      force_.segment<3>(near[static_cast<std::size_t>(i)]) = lambda.segment<3>(3 * i);
    u_ = -(C_ * force_);
  }

  double friction_;
  std::vector<Index> stored_;
  std::vector<Vec3> rest_;
  Eigen::MatrixXd C_;
  Eigen::VectorXd u_, force_;
  Vec3 centre_ = Vec3::Zero();
  bool is_first_ = true;
};

Index groups(const State& state) {
  const auto contacts = state.contacts();
  return static_cast<Index>(std::count_if(
      contacts.begin(), contacts.end(), [](const ContactPoint& contact) { return contact.aggregate >= 0; }));
}

State begin(double friction, Index room) {
  return State(cube(), {.tools = {plain({.radius = radius, .friction = friction})}, .max_contacts = room});
}

/// Presses in, and slides.
Vec3 centre(int tick) {
  return {0.42 + 0.0004 * std::max(0, tick - 200), 0.5, 1.0 + radius + 0.01 - 0.0008 * std::min(200, tick)};
}
constexpr int ticks = 450;

/// What contact at every node says of that way.
struct Reference {
  std::vector<Vec3> force;  ///< on the sphere, tick by tick
  int most_closed = 0;      ///< nodes that carry force
};

/// Solved once for all cases of a coefficient of friction.
const Reference& reference(double friction) {
  static std::map<double, Reference> solved;
  const auto [entry, is_new] = solved.try_emplace(friction);
  Reference& result = entry->second;
  if (is_new) {
    EveryNode every(cube(), friction);
    for (int tick = 0; tick < ticks; ++tick) {
      result.force.push_back(every.step(centre(tick)));
      result.most_closed = std::max(result.most_closed, every.closed());
    }
  }
  return result;
}

struct Case {
  const char* name;
  double friction;
  Index room;
  double tolerance;
};

void PrintTo(const Case& c, std::ostream* out) {  // NOLINT(readability-identifier-naming): GoogleTest's
  *out << c.name;
}

class Merging : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Cases, Merging,
                         testing::Values(Case{"unmerged", 0.0, 256, 1e-4},
                                         Case{"frictionless", 0.0, 64, 5e-3},
                                         Case{"friction", 0.3, 100, 5e-3},
                                         Case{"little_room", 0.3, 48, 5e-3}));

// The force of a press and a slide is that of contact at every node, however few contact points have room.
TEST_P(Merging, LeavesTheForceAsItIs) {
  State state = begin(GetParam().friction, GetParam().room);
  const Reference& every = reference(GetParam().friction);
  double largest = 0.0;
  double difference = 0.0;
  Index most_groups = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    const StepStatus status = step(cube(), state, pose(centre(tick)));
    ASSERT_EQ(status, StepStatus::ok) << tick;
    const Vec3& expected = every.force[static_cast<std::size_t>(tick)];
    largest = std::max(largest, expected.norm());
    difference = std::max(difference, (state.tools.front().contact_wrench.force - expected).norm());
    most_groups = std::max(most_groups, groups(state));
  }
  EXPECT_GT(every.most_closed, 60);
  if (GetParam().room == 256) {
    EXPECT_EQ(most_groups, 0);
  } else {
    EXPECT_GT(most_groups, 4);
  }
  EXPECT_LT(difference, GetParam().tolerance * largest);
  RecordProperty("relative_difference", std::to_string(difference / largest));
}

// Merging and parting change no force by themselves.
TEST_P(Merging, DoesNotJump) {
  State state = begin(GetParam().friction, GetParam().room);
  Vec3 last = Vec3::Zero();
  std::vector<double> other, when_changed;
  for (int tick = 0; tick < 200; ++tick) {
    step(cube(), state, pose(centre(tick)));
    const Vec3 force = state.tools.front().contact_wrench.force;
    if (tick > 60)
      (state.scratch.merging.has_changed ? when_changed : other).push_back((force - last).norm());
    last = force;
  }
  if (GetParam().tolerance <= 1e-4) return;
  ASSERT_GT(when_changed.size(), 5U);
  ASSERT_GT(other.size(), 5U);
  EXPECT_LT(*std::max_element(when_changed.begin(), when_changed.end()),
            1.3 * *std::max_element(other.begin(), other.end()));
}

/// What a merged contact point is to be, from its nodes.
struct Expected {
  double gap = 0.0;  // where the tick began
  double weights = 0.0;
  double mean_normal = 0.0;    // length of it
  double along_normals = 1.0;  // least cosine of a node's force and its own normal
  Vec3 force = Vec3::Zero();   // sum of what a force of 1 along the group's normal is at the nodes
};

Expected expected(const State& state, const ContactPoint& contact, const std::vector<Vec3>& places,
                  const Vec3& tool) {
  const Index place = state.surface.near.place_of(cube().aggregate_node(contact.aggregate));
  Expected result;
  Vec3 normals = Vec3::Zero();
  state.surface.near.for_each_member(place, [&](Index node, double weight, const Eigen::Matrix3d& map) {
    const Vec3 across = tool - places[static_cast<std::size_t>(node)];
    const Vec3 force = map * contact.frame.col(0);
    result.gap += weight * (across.norm() - radius);
    result.weights += weight;
    result.force += force;
    normals += weight * across.normalized();
    result.along_normals = std::min(result.along_normals, force.normalized().dot(across.normalized()));
  });
  result.mean_normal = normals.norm();
  result.gap /= result.mean_normal;
  return result;
}

// A merged contact point's gap is the mean of its nodes', and each of them is pressed along its own normal.
// In each second tick the tool stays, so that normals are those of where it is and not of where it is to be.
TEST(MergingPoint, StandsForItsNodes) {
  State state = begin(0.3, 100);
  int seen = 0;
  int other_gaps = 0;  // of a tick's second pass
  double least_mean = 1.0;
  for (int tick = 0; tick < ticks; ++tick) {
    step(cube(), state, pose(centre(tick)));
    std::vector<Vec3> places;
    for (Index node = 0; node < static_cast<Index>(cube().surface_rest_positions().size()); ++node)
      places.push_back(state.surface.tree.position(node));
    const Vec3 tool = state.tools.front().pose.position;
    step(cube(), state, pose(centre(tick)));
    for (const ContactPoint& contact : state.contacts()) {
      if (contact.aggregate < 0) continue;
      const Expected right = expected(state, contact, places, tool);
      ++seen;
      if (std::abs(contact.gap - right.gap) > 1e-12) ++other_gaps;
      EXPECT_NEAR(right.weights, 1.0, 1e-12);
      EXPECT_NEAR(right.force.dot(contact.frame.col(0)), 1.0, 2e-3) << "as it was when they were merged";
      EXPECT_GT(right.along_normals, 0.9998) << tick;
      least_mean = std::min(least_mean, right.mean_normal);
    }
  }
  EXPECT_GT(seen, 1000);
  EXPECT_LT(other_gaps, seen / 5);
  EXPECT_LT(least_mean, 0.999) << "normals differ by more than a node's force from its own";
}

// The solver begins with the forces that there were, however they are merged now.
TEST_P(Merging, BeginsWithTheForcesOfTheTickBefore) {
  State state = begin(GetParam().friction, GetParam().room);
  Vec3 last = Vec3::Zero();
  int seen = 0;
  for (int tick = 0; tick < 200; ++tick) {
    step(cube(), state, pose(centre(tick)));
    const Scratch& scratch = state.scratch;
    if (scratch.merging.has_changed) {
      Vec3 guess = Vec3::Zero();
      for (Index i = 0; i < scratch.problem.rows; ++i)
        guess += scratch.problem.guess[static_cast<std::size_t>(i)] *
                 scratch.rows[static_cast<std::size_t>(i)].force;
      EXPECT_LT((guess - last).norm(), 0.05 * last.norm()) << tick;
      ++seen;
    }
    last = state.tools.front().contact_wrench.force;
  }
  EXPECT_GT(seen, GetParam().tolerance > 1e-4 ? 5 : -1);
}

// A tool that rests is held by a force that rests.
TEST_P(Merging, ComesToRest) {
  State state = begin(GetParam().friction, GetParam().room);
  for (int tick = 0; tick < 300; ++tick) step(cube(), state, pose(centre(tick)));
  test::hold(cube(), state, pose(centre(299)), 200);
  const Vec3 force = state.tools.front().contact_wrench.force;
  for (int tick = 0; tick < 100; ++tick) {
    EXPECT_EQ(step(cube(), state, pose(centre(299))), StepStatus::ok);
    EXPECT_LT((state.tools.front().contact_wrench.force - force).norm(), 1e-9 * force.norm());
  }
}

// A grab holds groups by all of their nodes: it neither opens nor slides when pulled, and resists turning.
TEST(MergingGrab, HoldsGroups) {
  State state = begin(0.3, 100);
  for (int tick = 0; tick < 200; ++tick) step(cube(), state, pose(centre(tick)));
  ASSERT_GT(groups(state), 4);
  const Vec3 at = centre(199);
  step(cube(), state, pose(at, true));
  EXPECT_GT(state.held_count, 4);
  const Vec3 pressed = state.tools.front().contact_wrench.force;
  test::go(cube(), state, at, pose(at + Vec3(0.0, 0.0, 0.2), true), 200);
  EXPECT_LT(state.tools.front().contact_wrench.force.z(), -0.1 * pressed.z()) << "it pulls the surface up";
  EXPECT_EQ(state.status, StepStatus::ok);
  for (const ContactPoint& contact : state.contacts()) {
    if (!contact.held || contact.aggregate < 0) continue;
    const Vec3 tool_place = state.tools.front().pose.position + contact.arm;
    EXPECT_LT((tool_place - contact.position).norm(), 0.002);
  }
  test::go(cube(), state, at + Vec3(0.0, 0.0, 0.2), pose(at + Vec3(0.0, 0.0, 0.3)), 100);
  EXPECT_EQ(state.tools.front().contacts, 0);
}

}  // namespace
}  // namespace palpate::merging_test
