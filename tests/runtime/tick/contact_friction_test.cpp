// Coulomb friction of the tick: what sticks, what slips, and that it does not creep.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/vectors.h"
#include "meshes/generate.h"
#include "runtime/core/solve/cone_solver.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::contact_friction_test {
namespace {

using test::friction_force;
using test::go;
using test::hold;
using test::normal_force;
using test::plain;
using test::pose;
using test::slip;

/// A cube or, in the plane, a square, whose edge is `edge_`, and a sphere as large as that.
class Friction : public testing::TestWithParam<int> {
 protected:
  Body body_{test::unit_model(GetParam(), 6, Scope::surface, Precision::double_precision)};
  double edge_ = body_.mean_surface_edge();
  double radius_ = edge_;

  static Vec3 at(double x, double y, double z) { return test::upright(GetParam(), x, y, z); }
  [[nodiscard]] Vec3 pressed(double depth) const { return at(0.47, 0.53, 1.0 + radius_ - depth); }

  /// Pressed in and come to rest.
  [[nodiscard]] State touching(const Body& body, double friction, double depth) const {
    State state(body, {.tools = {plain({.radius = radius_, .friction = friction})}});
    go(body, state, pressed(-0.2 * depth), pose(pressed(depth)), 30);
    hold(body, state, pose(pressed(depth)), 60);
    return state;
  }
  static Vec3 tangential(const Vec3& force) { return force - force.dot(at(0, 0, 1)) * at(0, 0, 1); }
};
INSTANTIATE_TEST_SUITE_P(Dimension, Friction, testing::Values(2, 3));

/// Force on the tool when all closed contacts go along with it by `motion`: by W of all their axes, dense.
Vec3 force_of_stuck_contacts(const Body& body, const State& state, const Vec3& motion) {
  const int d = body.dimension();
  std::vector<ContactPoint> closed;
  for (const ContactPoint& contact : state.contacts()) {
    if (contact.force.squaredNorm() > 0.0) closed.push_back(contact);
  }
  const auto count = static_cast<Eigen::Index>(closed.size());
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(d * count, d * count);
  Eigen::VectorXd r(d * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    r.segment(d * i, d) = motion.head(d);
    for (Eigen::Index j = 0; j < count; ++j) {
      const ContactPoint& a = closed[static_cast<std::size_t>(i)];
      const ContactPoint& b = closed[static_cast<std::size_t>(j)];
      for (std::size_t m = 0; m < 3; ++m) {
        for (std::size_t n = 0; n < 3; ++n) {
          if (a.nodes[m] < 0 || b.nodes[n] < 0) continue;
          W.block(d * i, d * j, d, d) +=
              a.weights[m] * b.weights[n] *
              body.greens().block(body.surface_stored_nodes()[static_cast<std::size_t>(a.nodes[m])],
                                  body.surface_stored_nodes()[static_cast<std::size_t>(b.nodes[n])]);
        }
      }
    }
  }
  const Eigen::VectorXd f = W.partialPivLu().solve(r);
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index i = 0; i < count; ++i)
    sum += vector_at({f.data(), static_cast<std::size_t>(f.size())}, d, static_cast<Index>(i));
  return -sum;
}

// So shallow that the surface hardly turns.
TEST_P(Friction, ForceOfAStickingDragGrowsByTheTangentialStiffness) {
  const double depth = 1e-3 * radius_;
  State state = touching(body_, 5.0, depth);
  const Vec3 before = state.tools[0].wrench.force;
  const Vec3 drag = 0.5 * depth * at(1.0, 0.0, 0.0);
  const Vec3 expected = force_of_stuck_contacts(body_, state, drag);
  go(body_, state, pressed(depth), pose(pressed(depth) + drag), 100);
  const Vec3 change = state.tools[0].wrench.force - before;
  EXPECT_LT((change - expected).norm(), 1e-3 * expected.norm());
  EXPECT_LT(change.dot(drag), 0.0) << "it holds back";
}

// What slides is what the rounding of Xi is guarded by gives way, 1e-9 of the body's own.
TEST_P(Friction, NothingSlidesWhileItSticks) {
  State state = touching(body_, 5.0, 0.3 * radius_);
  const double drag = 0.1 * radius_;
  double slid = 0.0;
  int closed = 0;
  constexpr int ticks = 200;
  for (int k = 1; k <= ticks; ++k) {
    step(body_, state, pose(pressed(0.3 * radius_) + at(drag * k / ticks, 0.0, 0.0)));
    for (const ContactPoint& contact : state.contacts()) {
      if (normal_force(contact) <= 0.0) continue;
      ++closed;
      slid += slip(state, contact).norm();
    }
  }
  EXPECT_GE(closed, ticks);
  EXPECT_LT(slid, 2e-9 * drag);
  EXPECT_GT(tangential(state.tools[0].wrench.force).norm(), 0.05 * state.tools[0].wrench.force.norm());
}

TEST_P(Friction, SlipsAtMuTimesTheNormalForceAgainstTheSlip) {
  constexpr double mu = 0.2;
  State state = touching(body_, mu, 0.3 * radius_);
  int slipping = 0;
  for (int k = 1; k <= 200; ++k) {
    const StepStatus status =
        step(body_, state, pose(pressed(0.3 * radius_) + 0.002 * k * radius_ * at(1.0, 0.5, 0.0)));
    ASSERT_FALSE(has(status, StepStatus::not_converged));
    double largest = 0.0;
    for (const ContactPoint& contact : state.contacts()) largest = std::max(largest, contact.force.norm());
    const double tolerance = 3.0 * tuning.cone.tolerance * largest;
    for (const ContactPoint& contact : state.contacts()) {
      const double bound = mu * normal_force(contact);
      const Vec3 friction = friction_force(contact);
      const Vec3 slid = slip(state, contact);
      EXPECT_LE(friction.norm(), bound + tolerance);
      if (bound <= 0.0 || slid.norm() < 1e-5 * radius_) continue;
      ++slipping;
      EXPECT_GE(friction.norm(), bound - tolerance);
      // The solver's equation weighs the slip, which is about a tenth of what the friction deflects here.
      EXPECT_LT((friction + bound * slid.normalized()).norm(), 10.0 * tolerance) << "opposed to the slip";
    }
  }
  EXPECT_GT(slipping, 100);
}

TEST_P(Friction, WithoutFrictionNothingHoldsBack) {
  State state = touching(body_, 0.0, 1e-3 * radius_);
  go(body_, state, pressed(1e-3 * radius_), pose(pressed(1e-3 * radius_) + at(0.2 * edge_, 0.0, 0.0)), 100);
  const Vec3 force = state.tools[0].wrench.force;
  EXPECT_GT(force.norm(), 0.0);
  EXPECT_LT(tangential(force).norm(), 1e-2 * force.norm()) << "the dent is shallow";
}

// Also where what guards the rounding of Xi gives way by 5e-7 of the compliance.
TEST_P(Friction, DoesNotCreep) {
  for (const Precision precision : {Precision::double_precision, Precision::single_precision}) {
    const Body body(test::unit_model(GetParam(), 4, Scope::surface, precision));
    State state = touching(body, 0.5, 0.3 * radius_);
    const ToolPose dragged = pose(pressed(0.3 * radius_) + at(0.05 * radius_, 0.02 * radius_, 0.0));
    go(body, state, pressed(0.3 * radius_), dragged, 50);
    hold(body, state, dragged, 200);
    const auto displacement = [&] {
      Eigen::VectorXd u(body.greens().order());
      surface_displacement(body, state, {u.data(), static_cast<std::size_t>(u.size())});
      return u;
    };
    const Vec3 force = state.tools[0].wrench.force;
    const Eigen::VectorXd u = displacement();
    EXPECT_GT(tangential(force).norm(), 0.05 * force.norm());
    hold(body, state, dragged, 100000);
    EXPECT_LT((state.tools[0].wrench.force - force).norm(), 1e-10 * force.norm());
    EXPECT_LT((displacement() - u).norm(), 1e-10 * u.norm());
  }
}

/// Drags a sphere by its depth: the share of the normal force that then holds it back.
double drag_share(const Body& body, State& state, const Vec3& place, double depth) {
  const int d = body.dimension();
  const Vec3 up = test::upright(d, 0.0, 0.0, 1.0);
  go(body, state, place + 1.2 * depth * up, pose(place), 30);
  go(body, state, place, pose(place + depth * test::upright(d, 1.0, 0.0, 0.0)), 30);
  const Vec3 force = state.tools[0].wrench.force;
  return (force - force.dot(up) * up).norm() / force.dot(up);
}

TEST_P(Friction, IsThatOfTheMaterialUnlessTheToolHasItsOwn) {
  Model model = test::unit_model(GetParam(), 6, Scope::surface, Precision::double_precision);
  model.materials.push_back(model.materials[0]);
  model.materials[0].friction = 2.0;
  model.materials[1].friction = 0.1;
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const std::span<const Index> nodes = model.mesh.element_nodes(e);
    double middle = 0.0;
    for (const Index node : nodes)
      middle += model.mesh.nodes[static_cast<std::size_t>(node)].x() / static_cast<double>(nodes.size());
    model.material_of_element[static_cast<std::size_t>(e)] = middle < 0.5 ? 0 : 1;
  }
  const Body body(std::move(model));
  const double depth = 1e-3 * radius_;
  const auto share_at = [&](double x, std::optional<double> own) {
    State state(body, {.tools = {plain({.radius = radius_, .friction = own})}});
    return drag_share(body, state, at(x, 0.53, 1.0 + radius_ - depth), depth);
  };
  EXPECT_GT(share_at(0.3, {}), 0.3) << "it sticks";
  EXPECT_NEAR(share_at(0.7, {}), 0.1, 2e-3) << "it slips";
  EXPECT_NEAR(share_at(0.3, 0.05), 0.05, 2e-3);
  EXPECT_GT(share_at(0.7, 2.0), 0.15) << "its own, and it was pressed the other way";
}

TEST_P(Friction, TorqueAboutASpheresCentreIsThatOfFriction) {
  State smooth = touching(body_, 0.0, 0.3 * radius_);
  EXPECT_GT(smooth.tools[0].wrench.force.norm(), 0.0);
  EXPECT_LT(smooth.tools[0].wrench.torque.norm(), 1e-9 * radius_ * smooth.tools[0].wrench.force.norm());

  State rough = touching(body_, 0.2, 0.3 * radius_);
  const ToolPose dragged = pose(pressed(0.3 * radius_) + at(0.2 * radius_, 0.0, 0.0));
  go(body_, rough, pressed(0.3 * radius_), dragged, 100);
  hold(body_, rough, dragged, 60);
  Vec3 torque = Vec3::Zero();
  for (const ContactPoint& contact : rough.contacts())
    torque += -radius_ * contact.frame.col(0).cross(friction_force(contact));
  EXPECT_GT(torque.norm(), 0.1 * radius_ * rough.tools[0].wrench.force.norm());
  EXPECT_LT((rough.tools[0].wrench.torque - torque).norm(), 1e-6 * torque.norm());
}

// Half a cell deep it folds the surface over itself. Caught between the two sides, whose normals are opposed,
// it pulled five times as much as without friction, as far as it went; a place that it hooks may still pull
// twice as much.
TEST(PointTool, IsNotCaughtInAFoldAndSaysWhenItIsInside) {
  const Body body(test::bake(
      generate(BoxShape{.size = {12.0, 8.0, 5.0}, .cells = {12, 8, 5}}, ElementType::hex8),
      [](const Vec3& node) { return node.z() < 1e-9; }, Scope::surface, Precision::double_precision));
  const Vec3 down(3.3, 4.2, 4.5);
  const auto largest_force = [&](double friction) {
    State state(body, {.tools = {plain({.friction = friction})}});
    go(body, state, down + Vec3(0.0, 0.0, 0.8), pose(down), 200);
    double largest = 0.0;
    for (int k = 1; k <= 600; ++k) {
      step(body, state, pose(down + Vec3(0.01, 0.0003, 0.0) * k));
      const ToolState& tool = state.tools[0];
      largest = std::max(largest, tool.contact_wrench.force.norm());
      EXPECT_TRUE(tool.contacts > 0 || !tool.contact_wrench.force.isZero(0.0) ||
                  has(state.status, StepStatus::inside_body))
          << "half a cell deep and nothing said in tick " << k;
    }
    return largest;
  };
  const double smooth = largest_force(0.0);
  EXPECT_LT(largest_force(0.1), 1.5 * smooth);
  EXPECT_LT(largest_force(0.3), 2.0 * smooth);
}

}  // namespace
}  // namespace palpate::contact_friction_test
