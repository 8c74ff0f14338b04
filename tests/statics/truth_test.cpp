// Large deformation against CalculiX (2.20, NLGEOM, the same meshes and material), by
// scripts/studies/live-truth, which stored these figures: a force along the bar [N], a moment [N m], a force
// of indentation [N].
#include <gtest/gtest.h>

#include <map>

#include "tests/support/bodies/live_cases.h"

namespace palpate::live_truth_test {
namespace {

const std::map<std::string, std::vector<double>> calculix = {
    {"bar-tet10", {-0.094236706, 0.10567091, 0.18038391, 0.29074785}},
    {"bar-tet4", {-0.10300699, 0.11543976, 0.19668412, 0.31599556}},
    {"bending-tet10", {4.6689251e-06, 1.8672044e-05, 4.1994093e-05, 8.3864138e-05}},
    {"bending-tet4", {1.6991059e-05, 6.612246e-05, 0.00013799373, 0.00023885793}},
    {"indentation-tet10", {0.3890861, 0.78926755, 1.1794736}},
    {"indentation-tet4", {0.56401049, 1.1997552, 1.8936749}}};

TEST(LiveTruth, NeoHookeanBodiesAreThoseOfCalculix) {
  for (const test::LargeCase& large : test::large_cases()) {
    const std::vector<double> figures = test::solve_large(large, LiveLaw::neo_hookean);
    const std::vector<double>& truth = calculix.at(large.name);
    ASSERT_EQ(figures.size(), truth.size()) << large.name;
    for (std::size_t k = 0; k < truth.size(); ++k)
      EXPECT_NEAR(figures[k] / truth[k], 1.0, 1e-5) << large.name << " at " << large.levels[k];
  }
}

// What a user may ask of small strain: an end in sight, and on the side that the page says.
TEST(LiveTruth, SmallStrainEndsWhereThePageSays) {
  const test::LargeCase bending = test::bending_case(ElementType::tet10);
  const std::vector<double> linear = test::solve_large(bending, LiveLaw::linear),
                            turned = test::solve_large(bending, LiveLaw::corotational);
  const std::vector<double>& truth = calculix.at(bending.name);
  EXPECT_NEAR(linear[0] / truth[0], 1.074, 0.005);        // 5 degrees
  EXPECT_GT(linear[1] / truth[1], 2.0);                   // 20 degrees
  EXPECT_LT(std::abs(turned[2] / truth[2] - 1.0), 0.05);  // 45 degrees
}

}  // namespace
}  // namespace palpate::live_truth_test
