// How far a body may turn, against curves that warp_cases.h has by Green's functions, and by hand.
#include "precompute/warping/warp_study.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "precompute/warping/loaded_part.h"
#include "statics/range_of_errors.h"
#include "tests/support/bodies/warp_cases.h"

namespace palpate::warp_study_test {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

WarpOptions options(double degrees, Index levels, const std::optional<Selection>& where = {},
                    const std::optional<Vec3>& direction = {}) {
  WarpOptions options;
  options.where = where;
  options.direction = direction;
  options.angle = degrees * degree;
  options.levels = levels;
  options.place = "model.toml:3:1";
  return options;
}

std::optional<WarpStudyResult> study(const Model& model, const WarpOptions& options) {
  return study_warp(model, options, [](double) { return true; });
}

Selection end_face() {
  return SelectHalfSpace{{test::bent_length - 1e-6, 0, 0}, {1, 0, 0}};
}

class WarpStudyOf : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Element, WarpStudyOf, testing::Values(ElementType::quad4, ElementType::tet4),
                         [](const auto& of) { return traits(of.param).name; });

// Another route: Green's functions in place of a factor, forces in small equal steps, errors by
// interpolation.
TEST_P(WarpStudyOf, FindsTheErrorsOfTheCantilever) {
  const Model model = test::bent_model(GetParam());
  const int d = model.dimension();
  const Vec3 up = Vec3::Unit(d - 1);
  // A bar of tetrahedra bends a little to the side too, where the two ways to turn the force differ, and
  // further on the other one does not find its direction.
  const double most = d == 2 ? 60.0 : 40.0, same_by = d == 2 ? 1e-3 : 5e-3;
  const std::optional<WarpStudyResult> found = study(model, options(most, 4, end_face(), 3.0 * up));
  ASSERT_TRUE(found);
  const WarpStudy& curve = found->study;
  EXPECT_EQ(found->note, "");
  EXPECT_LT((curve.direction - up).norm(), 1e-15);
  EXPECT_EQ(std::ssize(curve.nodes), d == 2 ? 5 : 9);
  EXPECT_NEAR(curve.rotation.back(), most * degree, 0.5 * degree);
  EXPECT_LT(curve.rotation.front(), 20.0 * degree);

  const Body small(model), turning(warped_model(model), {}, 1, ContactModel::warped);
  const double last = curve.force.back();
  const auto bent = [&](const test::BendingLaw& law) {
    return test::bend(model.mesh, law, test::BendingLoad::follows, last / 60.0, 1e9, 80);
  };
  const std::vector<test::Bent> truth = bent(test::corotational(model)),
                                linear = bent(test::small_strain(small)),
                                warped = bent(test::warped(turning));
  const auto force = [](const test::Bent& at) { return at.force; };
  const auto height = [&](const test::Bent& at) { return test::rise(at, d); };
  const auto tip = [&](const std::vector<test::Bent>& of, double F) {
    Vec3 there;
    for (int axis = 0; axis < 3; ++axis)
      there[axis] = test::at(of, F, force, [axis](const test::Bent& at) { return at.tip[axis]; });
    return there;
  };
  for (std::size_t k = 0; k < curve.force.size(); ++k) {
    const double F = curve.force[k];
    const Vec3 there = tip(truth, F);
    EXPECT_NEAR(curve.rotation[k], test::at(truth, F, force, [](const test::Bent& at) { return at.angle; }),
                0.02 + 0.05 * curve.rotation[k]);  // the end face has turned about as far as what turned most
    for (const auto& [errors, law] : {std::pair(&curve.linear, &linear), std::pair(&curve.warped, &warped)}) {
      const double displacement = (tip(*law, F) - there).norm() / there.norm();
      EXPECT_NEAR(errors->displacement[k], displacement, same_by + 0.01 * displacement) << k;
      const double same = test::at(*law, there[d - 1], height, force) / F - 1.0;
      if (std::isnan(same)) {  // no force lifts it so high, or none of this curve
        EXPECT_GT(errors->force[k], 0.2) << k;
      } else {
        EXPECT_NEAR(errors->force[k], same, same_by + 0.01 * std::abs(same)) << k;
      }
    }
    EXPECT_LT(std::abs(curve.warped.force[k]), 0.05) << k;
  }
  const double range = range_within(curve.rotation, curve.linear.force, good_bending_error) / degree;
  EXPECT_NEAR(range, 23.5, d == 2 ? 1.5 : 4.0);  // docs/measurements/live.md, a force that follows the end
  EXPECT_GT(range, 10.0);
  EXPECT_LT(range, 30.0);
}

// What is left out: the end that is farthest from what is held, along the softest direction, across the bar.
// (Kuhn's tetrahedra are softer along a diagonal.)
TEST_P(WarpStudyOf, BendsTheFreeEndByItself) {
  const Model model = test::bent_model(GetParam());
  const std::optional<WarpStudyResult> found = study(model, options(30.0, 3));
  ASSERT_TRUE(found);
  for (const Index node : found->study.nodes)
    EXPECT_GE(model.mesh.nodes[static_cast<std::size_t>(node)].x(), 0.95 * test::bent_length);
  EXPECT_LT(std::abs(found->study.direction.x()), 0.02);
  EXPECT_NEAR(found->study.direction.norm(), 1.0, 1e-12);
  EXPECT_NEAR(found->study.rotation.back(), 30.0 * degree, 0.5 * degree);
}

// Warped, a cantilever is right up to a right angle, as docs/measurements/live.md has it.
TEST(WarpStudy, GoesToARightAngle) {
  const std::optional<WarpStudyResult> found =
      study(test::bent_model(ElementType::quad4), options(90.0, 12, end_face(), Vec3(0, 1, 0)));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->note, "");
  EXPECT_NEAR(found->study.rotation.back(), 90.0 * degree, 0.5 * degree);
  EXPECT_NEAR(found->study.warped.force.back(), 0.018, 0.003);
  EXPECT_NEAR(found->study.warped.displacement.back(), 0.012, 0.003);
  EXPECT_NEAR(found->study.linear.force.back(), 0.014, 0.02);
  EXPECT_NEAR(found->study.linear.displacement.back(), 0.582, 0.02);
}

TEST(WarpStudy, IsRepeatedByItsForces) {
  Model model = test::bent_model(ElementType::tet4);
  model.warp = study(model, options(40.0, 4))->study;
  const WarpStudy again = repeat_warp_study(model);
  ASSERT_EQ(again.force, model.warp.force);
  for (std::size_t k = 0; k < again.force.size(); ++k) {
    EXPECT_NEAR(again.rotation[k], model.warp.rotation[k], 1e-4);
    EXPECT_NEAR(again.warped.force[k], model.warp.warped.force[k], 1e-4);
    EXPECT_NEAR(again.linear.displacement[k], model.warp.linear.displacement[k], 1e-4);
  }
}

TEST(WarpStudy, IsStopped) {
  const Model model = test::bent_model(ElementType::quad4);
  int asked = 0;
  EXPECT_FALSE(study_warp(model, {}, [&](double) { return ++asked < 3; }));
  EXPECT_EQ(asked, 3);
}

TEST(WarpStudy, SaysWhatCannotBeLoaded) {
  const Model model = test::bent_model(ElementType::quad4);
  try {
    study(model, options(90.0, 6, SelectHalfSpace{{0, 0, 0}, {-1, 0, 0}}));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), "model.toml:3:1");
    EXPECT_NE(std::string(error.what()).find("no node of the surface that is free"), std::string::npos);
  }
}

TEST(SoftestDirection, IsThatOfTheLargestEigenvalue) {
  const Mat3 turn = Eigen::AngleAxisd(0.4, Vec3(1, 2, 2) / 3.0).toRotationMatrix();
  const Mat3 softness = turn * Vec3(1.0, 3.0, 2.0).asDiagonal() * turn.transpose();
  EXPECT_LT((softest_direction(softness, 3) - turn.col(1)).norm(), 1e-12);
  const Mat3 alike = turn * Vec3(3.0, 1.0, 3.0).asDiagonal() * turn.transpose();
  EXPECT_NEAR(softest_direction(alike, 3).dot(turn.col(1)), 0.0, 1e-12);
  EXPECT_EQ(softest_direction(Vec3(2.0, 2.0, 2.0).asDiagonal(), 3), Vec3(0, 0, 1));
  EXPECT_EQ(softest_direction(Vec3(2.0, 2.0, 0.0).asDiagonal(), 2), Vec3(0, 1, 0));
}

TEST(RangeWithin, GoesByStraightLines) {
  const double infinity = std::numeric_limits<double>::infinity();
  const std::vector<double> rotation = {1.0, 2.0, 4.0};
  EXPECT_DOUBLE_EQ(range_within(rotation, std::vector{0.01, -0.03, 0.07}, 0.05), 3.0);
  EXPECT_DOUBLE_EQ(range_within(rotation, std::vector{0.1, 0.0, 0.0}, 0.05), 0.5);
  EXPECT_DOUBLE_EQ(range_within(rotation, std::vector{0.01, 0.02, infinity}, 0.05), 2.0);
  EXPECT_DOUBLE_EQ(range_within(rotation, std::vector{0.01, -0.04, 0.05}, 0.05), 4.0);
}

}  // namespace
}  // namespace palpate::warp_study_test
