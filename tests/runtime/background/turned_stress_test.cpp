// Stress on surfaces that have turned, against the same strain unturned and against what stretches a free
// edge.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "runtime/background/element_stress.h"
#include "runtime/background/surface_stress.h"
#include "runtime/depth/deep_body.h"
#include "tests/support/bodies/bent_bodies.h"

namespace palpate::turned_stress_test {
namespace {

constexpr double degree = std::numbers::pi / 180.0, E = 5e3;

std::vector<Stress> stress_of(const Body& body, const std::vector<Vec3>& u, const std::vector<Vec3>& force) {
  SurfaceStress surface(body);
  std::vector<Stress> stress(u.size());
  surface.evaluate(u, force, nullptr, stress);
  return stress;
}

class TurnedStress : public testing::TestWithParam<ElementType> {
 protected:
  TurnedStress()
      : model(test::bent_model(GetParam())),
        still(model),
        turning(deep_body(model)),
        at(still.surface_in_mesh()),
        turn(Eigen::AngleAxisd(100.0 * degree,
                               model.dimension() == 2 ? Vec3(0, 0, 1) : Vec3(Vec3(1, 2, -2) / 3.0))) {}

  Model model;
  Body still, turning;
  std::vector<Vec3> at;
  Mat3 turn;
};
INSTANTIATE_TEST_SUITE_P(Element, TurnedStress,
                         testing::Values(ElementType::quad4, ElementType::tet4, ElementType::hex8,
                                         ElementType::tet10),
                         [](const auto& of) { return traits(of.param).name; });

TEST_P(TurnedStress, IsNoneOfARigidTurn) {
  std::vector<Vec3> u, force(at.size(), Vec3::Zero());
  for (const Vec3& X : at) u.push_back(turn * X - X + Vec3(0.3, -0.2, model.dimension() == 2 ? 0.0 : 0.1));
  int known = 0;
  for (const Stress& stress : stress_of(turning, u, force)) {
    if (std::isnan(stress[0])) continue;
    ++known;
    EXPECT_LT(stress.norm(), 1e-9 * E);
  }
  EXPECT_GT(known, 20);
  for (Vec3& moved : u) moved.setZero();
  for (const Stress& stress : stress_of(turning, u, force)) {
    if (!std::isnan(stress[0])) {
      EXPECT_EQ(stress.norm(), 0.0) << "at rest there is nothing to colour";
    }
  }
}

// The body strained a little, and then turned as a whole with the forces on it: in its frames nothing has
// changed but for the square of the strain.
TEST_P(TurnedStress, TurnsWithTheBody) {
  Mat3 strain;
  strain << 1e-5, 4e-6, 2e-6, 4e-6, -2e-5, 3e-6, 2e-6, 3e-6, 1.5e-5;
  if (model.dimension() == 2) {
    strain.row(2).setZero();
    strain.col(2).setZero();
  }
  std::vector<Vec3> u, turned, force(at.size(), Vec3::Zero()), turned_force(force);
  for (std::size_t k = 0; k < at.size(); ++k) {
    u.emplace_back(strain * at[k]);
    turned.emplace_back(turn * (at[k] + u[k]) - at[k]);
    if (k % 3 == 0) force[k] = 1e-6 * Vec3(std::sin(k), std::cos(k), model.dimension() == 2 ? 0.0 : 0.5);
    turned_force[k] = turn * force[k];
  }
  const std::vector<Stress> as_it_was = stress_of(still, u, force),
                            now = stress_of(turning, turned, turned_force);
  double largest = 0.0;
  for (const Stress& stress : as_it_was)
    largest = std::isnan(stress[0]) ? largest : std::max(largest, stress.norm());
  EXPECT_GT(largest, 1e-6 * E);
  for (std::size_t k = 0; k < at.size(); ++k) {
    EXPECT_EQ(std::isnan(as_it_was[k][0]), std::isnan(now[k][0]));
    if (std::isnan(now[k][0])) continue;
    EXPECT_LT((as_it_was[k] - now[k]).norm(), 1e-3 * largest);
  }
}

// A cantilever of a thin sheet: along a free edge there is tension alone, E times the edge's stretch less 1.
TEST(BentStress, IsThatOfTheEdgesStretchAndOfTheCorotationalBody) {
  Model model = test::bent_model(ElementType::quad4);
  ASSERT_EQ(model.analysis, Analysis::plane_stress);
  const Body body = deep_body(model);
  const std::vector<Vec3> at = body.surface_in_mesh(), none(at.size(), Vec3::Zero());
  const test::BendingLaw truth = test::corotational(model), deep = test::on_two_levels(body);
  const test::EndFace face(model.mesh);
  // Both under the force that bends the truth by 60 degrees, in its direction.
  const double soft =
      test::bend(model.mesh, deep, test::BendingLoad::follows, 1e-6, 1.0, 1).back().angle / 1e-6;
  const test::Bent end =
      test::bend(model.mesh, truth, test::BendingLoad::follows, 3.0 * degree / soft, 60.0 * degree).back();
  const Vec3 force = end.force * Vec3(-std::sin(end.angle), std::cos(end.angle), 0.0);
  const auto bent =
      [&](const test::BendingLaw& law) {  // by and by, as balances are searched from the last one
        for (int part = 1; part < 20; ++part) law(face.spread(part / 20.0 * force));
        return law(face.spread(force));
      };
  const auto von_mises_of = [&](const std::vector<Vec3>& x) {
    std::vector<Vec3> u;
    for (std::size_t k = 0; k < at.size(); ++k)
      u.push_back(x[static_cast<std::size_t>(body.surface_mesh_nodes()[k])] - at[k]);
    std::vector<double> values;
    for (const Stress& stress : stress_of(body, u, none)) values.push_back(von_mises(stress));
    return values;
  };
  const std::vector<Vec3> by_truth = bent(truth), by_levels = bent(deep);
  ASSERT_GT(face.angle(by_truth), 60.0 * degree);
  const std::vector<double> live = von_mises_of(by_truth), now = von_mises_of(by_levels);
  const double largest = *std::max_element(live.begin(), live.end());
  int edges = 0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    const bool on_edge = at[k].y() < 1e-9 || at[k].y() > test::bent_height - 1e-9;
    if (!on_edge || at[k].x() < 0.2 * test::bent_length || at[k].x() > 0.8 * test::bent_length) continue;
    double stretch = 0.0;  // of the two sides at the node
    const double step = test::bent_length / 32;
    for (std::size_t j = 0; j < at.size(); ++j) {
      if (std::abs((at[j] - at[k]).norm() - step) > 1e-9 || at[j].y() != at[k].y()) continue;
      const auto node = [&](std::size_t n) {
        return by_truth[static_cast<std::size_t>(body.surface_mesh_nodes()[n])];
      };
      stretch += 0.5 * ((node(j) - node(k)).norm() / step - 1.0);
    }
    EXPECT_NEAR(live[k], E * std::abs(stretch), 0.02 * largest) << at[k].transpose();
    EXPECT_NEAR(now[k], live[k], 0.05 * largest) << at[k].transpose();
    ++edges;
  }
  EXPECT_GT(edges, 30);
}

// The inside of a body in the plane, whose rows are of the elements.
TEST(BentStress, OfTheInsideIsNoneOfARigidTurn) {
  for (const ElementType type : {ElementType::tri3, ElementType::quad4}) {
    const Model model = test::bent_model(type);
    const StressRows rows = element_stress(model);
    const Mat3 turn = Eigen::AngleAxisd(2.0, Vec3::UnitZ()).toRotationMatrix();
    std::vector<Vec3> u;
    for (const Vec3& X : model.mesh.nodes) u.emplace_back(turn * X - X);
    std::vector<Mat3> turns(u.size());
    std::vector<Stress> stress(u.size());
    rows.apply_turned(model.mesh.nodes, true, u, turns, stress);
    for (std::size_t k = 0; k < u.size(); ++k) {
      EXPECT_LT(stress[k].norm(), 1e-9 * E);
      EXPECT_LT((turns[k] - turn).norm(), 1e-12);
    }
  }
}

}  // namespace
}  // namespace palpate::turned_stress_test
