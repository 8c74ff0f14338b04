// The finger tip of `compare`: how its force is shared among the nodes under it.
#include <gtest/gtest.h>

#include <algorithm>

#include "meshes/generate.h"
#include "meshes/surface.h"
#include "precompute/numerics/touched_boundary.h"

namespace palpate::compare_test {
namespace {

/// A unit cube, or in the plane a square, of 4 cells per edge: held where its last coordinate is 0, with the
/// other nodes of the surface stored.
Model held_below(int dimension) {
  Model model;
  model.mesh = dimension == 3 ? generate(BoxShape{Vec3::Zero(), Vec3(1, 1, 1), {4, 4, 4}})
                              : generate(RectangleShape{Vec3::Zero(), Vec3(1, 1, 0), {4, 4}});
  const Surface surface = extract_surface(model.mesh);
  model.surface = surface_simplices(surface);
  model.fixed.assign(model.mesh.nodes.size(), 0);
  for (const Index node : surface.nodes) {
    const auto n = static_cast<std::size_t>(node);
    if (model.mesh.nodes[n][dimension - 1] < 1e-9) {
      model.fixed[n] = 7;
    } else {
      model.stored_nodes.push_back(node);
    }
  }
  return model;
}

class FingerTip : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, FingerTip, testing::Values(2, 3));

// On a side of the cube just above what is held: by symmetry about z = 0.25 the nodes at 0 carry what those
// at 0.5 do, and what is on held nodes is in nobody's share.
TEST_P(FingerTip, LosesWhatIsOnHeldNodes) {
  const int d = GetParam();
  const Model model = held_below(d);
  const TouchedBoundary boundary(model);
  const Vec3 place = d == 3 ? Vec3(0.0, 0.5, 0.25) : Vec3(0.0, 0.25, 0.0);
  const Tip tip = boundary.tip(place, 0.3);  // the node at `place` and, in space, four others around it
  const auto share_at = [&](const Vec3& x) {
    for (std::size_t k = 0; k < tip.stored.size(); ++k) {
      const Index node = model.stored_nodes[static_cast<std::size_t>(tip.stored[k])];
      if ((model.mesh.nodes[static_cast<std::size_t>(node)] - x).norm() < 1e-9) return tip.share[k];
    }
    return 0.0;
  };
  const Vec3 up = 0.25 * Vec3::Unit(d - 1);
  const double middle = share_at(place), above = share_at(place + up);
  EXPECT_EQ(share_at(place - up), 0.0) << "is held";
  // Regular nodes have equal areas but for the one on the edge between the side and what is held, which has
  // as much of the boundary on both: their weights are 1 and 1 - (0.25 / 0.3)^2.
  const double rim = 1.0 - 0.25 * 0.25 / (0.3 * 0.3);
  const int around = d == 3 ? 4 : 2;
  EXPECT_NEAR(above / middle, rim, 1e-12);
  EXPECT_NEAR(middle, 1.0 / (1.0 + around * rim), 1e-12);
  double sum = 0.0;
  for (const double share : tip.share) sum += share;
  EXPECT_NEAR(sum, 1.0 - rim / (1.0 + around * rim), 1e-12);
}

// Away from what is held the whole force is shared; under a tip without a size the nearest node has it all.
TEST_P(FingerTip, SharesAllOfItsForceElsewhere) {
  const int d = GetParam();
  const Model model = held_below(d);
  const TouchedBoundary boundary(model);
  const Vec3 top = d == 3 ? Vec3(0.5, 0.5, 1.0) : Vec3(0.5, 1.0, 0.0);
  for (const double radius : {0.0, 0.3, 0.6}) {
    const Tip tip = boundary.tip(top, radius);
    double sum = 0.0;
    for (const double share : tip.share) sum += share;
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_EQ(tip.stored.size() > 1, radius > 0.0);
  }
}

}  // namespace
}  // namespace palpate::compare_test
