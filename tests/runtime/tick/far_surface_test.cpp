// How old the far surface is: each node's place against where it was in the ticks before, by all forces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate {
namespace {

/// A sphere that sinks into the top of a cube, tick by tick.
class FarSurface : public testing::Test {
 protected:
  void press(int ticks) {
    ToolPose pose;
    for (int tick = 0; tick < ticks; ++tick) {
      pose.position = Vec3(0.5, 0.5, 1.0 + radius + 0.002 - speed * tick);
      step(body_, state_, pose);
      std::vector<double>& u = history_.emplace_back(static_cast<std::size_t>(body_.greens().order()));
      surface_displacement(body_, state_, u);
    }
  }

  /// Ticks ago that a surface node was where the tree has it; -1 for none.
  int age(Index node) const {
    const Index stored = body_.surface_stored_nodes()[static_cast<std::size_t>(node)];
    const Vec3 u = state_.surface.tree.position(node) - body_.surface_rest_positions()[node];
    for (std::size_t ago = 0; ago < history_.size(); ++ago) {
      const double* then = history_[history_.size() - 1 - ago].data() + 3 * std::ptrdiff_t{stored};
      if ((u - Vec3(then[0], then[1], then[2])).norm() < 1e-9) return static_cast<int>(ago);
    }
    return u.isZero(0.0) ? static_cast<int>(history_.size()) : -1;
  }

  bool is_near(Index node) const { return state_.surface.near.place_of(node) >= 0; }

  /// Surface nodes that are not near and share a simplex with one that is.
  std::vector<bool> beside_near_nodes() const {
    std::vector<bool> beside(body_.surface_rest_positions().size(), false);
    for (std::size_t at = 0; at < body_.simplices().size(); at += 3) {
      const std::span<const Index> corners = body_.simplices().subspan(at, 3);
      if (std::none_of(corners.begin(), corners.end(), [&](Index k) { return is_near(k); })) continue;
      for (const Index node : corners) beside[static_cast<std::size_t>(node)] = !is_near(node);
    }
    return beside;
  }

  static constexpr double radius = 0.4, speed = 0.0005;
  Body body_{test::bake(
      test::unit_mesh(ElementType::tet4, 8), [](const Vec3& node) { return node.z() < 1e-12; },
      Scope::surface, Precision::double_precision, false)};
  State state_{body_, {.tools = {Tool{.radius = radius}}}};
  std::vector<std::vector<double>> history_;
};

// Nodes beside those that are near wait for a round of the near runs, or for two where a run has only just
// become one; all others for a round of the whole body, which has a tick out of tuning.far.all_stride.
TEST_F(FarSurface, IsRenewedBesideTheToolFirst) {
  press(150);
  const auto nodes = static_cast<double>(body_.greens().nodes());
  const auto most = static_cast<double>(
      std::min(tuning.far.nodes, tuning.far.blocks / state_.surface.near.load().count + 1));
  const auto stride = static_cast<double>(tuning.far.all_stride);
  const double in_near_runs = static_cast<double>(tuning.far.run * state_.surface.sweep.near_run_count);
  const double near_ticks = 2.0 * std::ceil(in_near_runs / most) * stride / (stride - 1.0) + 1.0;
  const double all_ticks = std::ceil(nodes / most) * stride;
  ASSERT_LT(near_ticks, 0.5 * all_ticks) << "there is little to tell apart";

  const std::vector<bool> beside = beside_near_nodes();
  int oldest_beside = 0, oldest = 0;
  for (Index node = 0; node < static_cast<Index>(beside.size()); ++node) {
    if (is_near(node) || !body_.surface_moves(node)) continue;
    const int ticks = age(node);
    ASSERT_GE(ticks, 0) << "node " << node << " is where it never was";
    oldest = std::max(oldest, ticks);
    if (beside[static_cast<std::size_t>(node)]) oldest_beside = std::max(oldest_beside, ticks);
  }
  EXPECT_GT(oldest_beside, 0) << "there is nothing to be measured";
  EXPECT_LE(oldest_beside, near_ticks);
  EXPECT_LE(oldest, all_ticks);
  EXPECT_GT(oldest, near_ticks);
}

}  // namespace
}  // namespace palpate
