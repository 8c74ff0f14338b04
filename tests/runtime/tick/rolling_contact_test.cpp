// A sphere without friction: what it is told of the stiffness, and what moving it over the surface costs.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::rolling_contact_test {
namespace {

using test::go;
using test::hold;
using test::plain;
using test::pose;

/// Places over the top that see faces, edges and vertices.
std::vector<Vec3> places() {
  std::vector<Vec3> all;
  for (int i = 0; i < 8; ++i) all.emplace_back(0.31 + 0.047 * i, 0.62 - 0.037 * i, 1.0);
  all.emplace_back(0.5, 0.5, 1.0);
  return all;
}

class RollingContact : public testing::TestWithParam<double> {
 protected:
  Body body_{test::unit_model(3, 6, Scope::surface, Precision::double_precision)};
  double edge_ = body_.mean_surface_edge();
  double radius_ = GetParam() * edge_;

  /// Pressed in by a share of the radius, at rest.
  [[nodiscard]] State press(const Vec3& place, double share, Vec3& centre) const {
    centre = place + Vec3(0.0, 0.0, (1.0 - share) * radius_);
    const Vec3 above = place + Vec3(0.0, 0.0, 1.1 * radius_);
    State state(body_, {.tools = {plain({.radius = radius_, .friction = 0.0})}});
    go(body_, state, above, pose(centre), 200);
    hold(body_, state, pose(centre), 500);
    return state;
  }
};
INSTANTIATE_TEST_SUITE_P(Radii, RollingContact, testing::Values(0.6, 1.0, 2.0),
                         [](const testing::TestParamInfo<double>& tested) {
                           return "Radius" + std::to_string(static_cast<int>(10.0 * tested.param));
                         });

// Against the difference quotient of forces at rest, without what would push the hand on.
TEST_P(RollingContact, ToldStiffnessIsTheDerivativeAtRest) {
  const double step_size = 1e-5 * radius_;
  for (const Vec3& place : places()) {
    Vec3 centre;
    const State state = press(place, 0.2, centre);
    ASSERT_GT(state.tools[0].contacts, 0);
    Eigen::Matrix3d quotient;
    for (int axis = 0; axis < 3; ++axis) {
      const auto force_at = [&](double way) {
        State moved = state;
        hold(body_, moved, pose(centre + way * Vec3::Unit(axis)), 300);
        return moved.tools[0].wrench.force;
      };
      quotient.col(axis) = (force_at(-step_size) - force_at(step_size)) / (2.0 * step_size);
    }
    EXPECT_LT((quotient - quotient.transpose()).norm(), 1e-6 * quotient.norm());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (quotient + quotient.transpose()));
    const Eigen::Matrix3d expected = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
                                     eigen.eigenvectors().transpose();
    EXPECT_LT((state.tools[0].local.stiffness - expected).norm(), 0.005 * expected.norm())
        << place.transpose();
  }
}

// However fast it slides, and whichever face a vertex or edge is seen from.
TEST_P(RollingContact, EachPlaceIsOneContact) {
  Vec3 centre;
  State state = press(Vec3(0.45, 0.5, 1.0), 0.2, centre);
  std::size_t most = 0;
  for (int k = 1; k <= 100; ++k) {
    step(body_, state, pose(centre + Vec3(0.01 * edge_ * k, 0.005 * edge_ * k, 0.0)));
    std::set<std::int64_t> features;
    for (const ContactPoint& contact : state.contacts()) features.insert(contact.feature);
    ASSERT_EQ(std::ssize(features), std::ssize(state.contacts())) << k;
    most = std::max(most, features.size());
  }
  EXPECT_GT(most, 2U);
}

// What is left of a tick's lag: normals are foreseen by the motion of the tool, not by that of the surface.
TEST_P(RollingContact, AClosedLoopCostsNoWork) {
  const double size = edge_;
  for (const double per_tick : {0.001, 0.0056, 0.02}) {  // edges; 0.0056: 31 mm/s on the liver
    const int ticks = static_cast<int>(2.0 * std::numbers::pi / per_tick);
    Vec3 centre;
    State state = press(Vec3(0.55, 0.47, 1.0), 0.2, centre);
    double work = 0.0;
    double force = 0.0;
    Vec3 place = centre;
    for (int k = 1; k <= 2 * ticks; ++k) {
      if (k == ticks + 1) work = force = 0.0;  // the second round is closed
      const double angle = 2.0 * std::numbers::pi * k / ticks;
      const Vec3 next = centre + size * Vec3(std::cos(angle) - 1.0, std::sin(angle), 0.0);
      const Vec3 before = state.tools[0].wrench.force;
      step(body_, state, pose(next));
      work -= 0.5 * (before + state.tools[0].wrench.force).dot(next - place);
      force += state.tools[0].wrench.force.norm() / ticks;
      place = next;
    }
    const double share = work / (force * 2.0 * std::numbers::pi * size);  // drag, of the force
    RecordProperty("drag_at_" + std::to_string(per_tick), std::to_string(share));
    EXPECT_GE(share, 0.0) << per_tick;
    EXPECT_LT(share, 0.2 * per_tick / GetParam()) << per_tick;
  }
}

}  // namespace
}  // namespace palpate::rolling_contact_test
