// How a body is pushed that has no Green's functions.
#include "runtime/push/solved_settings.h"

#include <gtest/gtest.h>

#include "runtime/live/live_settings.h"

namespace palpate {
namespace {

/// A block of 0.2 x 0.1 x 0.05 m, or its face in the plane, that nothing holds, its lowest corner at (1, 2,
/// 3).
Model outline(ElementType element) {
  Model model;
  model.scope = Scope::none;
  model.mesh.element = element;
  const double depth = element == ElementType::tri3 ? 0.0 : 0.05;
  model.mesh.nodes = {{1.0, 2.0, 0.0}, {1.2, 2.0, 0.0}, {1.0, 2.1, 0.0}, {1.0, 2.0, depth}};
  model.fixed.assign(model.mesh.nodes.size(), 0);
  return model;
}

TEST(SolvedSettings, AreForBodiesWithoutGreensFunctionsAlone) {
  Model model = outline(ElementType::tet4);
  model.scope = Scope::surface;
  EXPECT_TRUE(solved_settings(model).empty());
  model.scope = Scope::none;
  model.fixed.front() = 4;
  EXPECT_EQ(solved_settings(model), (SettingsText{{"solver", "corotational"}}));
}

TEST(SolvedSettings, WhatNothingHoldsFallsIntoARoomAroundIt) {
  for (const ElementType element : {ElementType::tet4, ElementType::tri3}) {
    const Model model = outline(element);
    const LiveSettings live = read_settings(solved_settings(model)).live;
    const int up = element == ElementType::tri3 ? 1 : 2;
    EXPECT_EQ(live.gravity, -9.81 * Vec3::Unit(up));
    ASSERT_TRUE(live.room);
    for (const Vec3& node : model.mesh.nodes) {
      for (int axis = 0; axis < 3; ++axis) {  // its length of 0.2 m to each wall, half of it to the floor
        EXPECT_GE(node[axis] - live.room->low[axis], axis == up ? 0.1 - 1e-9 : 0.2 - 1e-9);
        EXPECT_GE(live.room->high[axis] - node[axis], 0.2 - 1e-9);
      }
    }
    EXPECT_NEAR(live.room->low[up], model.mesh.nodes.front()[up] - 0.1, 1e-9);
    EXPECT_TRUE(live_options(live).plasticity.flows());
  }
}

// Numbers are written out: a body that is far from the origin does not begin in its walls.
TEST(SolvedSettings, RoomIsAroundABodyFarAway) {
  Model model = outline(ElementType::tri3);
  for (Vec3& node : model.mesh.nodes) node += Vec3(1234.5678, -87.654321, 0.0);
  const LiveSettings live = read_settings(solved_settings(model)).live;
  ASSERT_TRUE(live.room);
  const double left = model.mesh.nodes.front().x();
  EXPECT_NEAR(left - live.room->low.x(), 0.2, 1e-5);
}

TEST(SolvedSettings, AreWrittenAsOptions) {
  EXPECT_EQ(option_text({{"creep", "20"}, {"solver", "corotational"}}), "--creep 20 --solver corotational");
  EXPECT_EQ(option_text({}), "");
}

}  // namespace
}  // namespace palpate
