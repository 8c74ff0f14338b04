// The kept compliance against the Green's functions that it is gathered from, and the contact points that a
// tick finds against what a naive search over the whole surface finds.
#include "runtime/core/body/near_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "base/vectors.h"
#include "runtime/body/body.h"
#include "runtime/core/solve/nearest_point.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::near_field_test {
namespace {

class NearFieldTest : public testing::TestWithParam<int> {
 protected:
  Body body_{
      test::unit_model(GetParam(), GetParam() == 3 ? 4 : 12, Scope::surface, Precision::double_precision)};

  [[nodiscard]] Index stored(Index surface_node) const {
    return body_.surface_stored_nodes()[static_cast<std::size_t>(surface_node)];
  }

  /// Surface nodes that are free to move, in a random order.
  [[nodiscard]] std::vector<Index> free_nodes(unsigned seed) const {
    std::vector<Index> nodes;
    for (Index node = 0; node < static_cast<Index>(body_.surface_stored_nodes().size()); ++node) {
      if (stored(node) >= 0) nodes.push_back(node);
    }
    std::shuffle(nodes.begin(), nodes.end(), std::mt19937(seed));
    return nodes;
  }

  void expect_compliance(const NearField& near) const {
    const int d = near.dimension();
    for (Index i = 0; i < near.count(); ++i) {
      ASSERT_EQ(near.place_of(near.node(i)), i);
      for (Index j = 0; j < near.count(); ++j) {
        const Eigen::MatrixXd xi = body_.greens().block(stored(near.node(i)), stored(near.node(j)));
        for (int p = 0; p < d; ++p) {
          for (int q = 0; q < d; ++q)
            ASSERT_EQ(near.row(d * i + p)[static_cast<std::size_t>(d * j + q)], xi(p, q));
        }
      }
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Dimension, NearFieldTest, testing::Values(2, 3));

TEST_P(NearFieldTest, KeepsTheComplianceOfWhatIsWantedWhileNodesComeAndGo) {
  NearField near(body_, 10);
  std::mt19937 random(2);
  const std::vector<Index> nodes = free_nodes(1);
  for (int tick = 0; tick < 300; ++tick) {
    near.begin_tick();
    std::set<Index> wanted;
    for (int k = 0; k < 6; ++k) wanted.insert(nodes[random() % nodes.size()]);
    for (const Index node : wanted) ASSERT_TRUE(near.want(body_, node));
    for (const Index node : wanted) ASSERT_GE(near.place_of(node), 0);
    ASSERT_LE(near.count(), 10);
    if (tick % 30 == 0) expect_compliance(near);
  }
}

TEST_P(NearFieldTest, IsFullOnlyOfWhatIsWantedOrLoaded) {
  NearField near(body_, 4);
  const std::vector<Index> nodes = free_nodes(3);
  near.begin_tick();
  for (std::size_t k = 0; k < 4; ++k) EXPECT_TRUE(near.want(body_, nodes[k]));
  EXPECT_FALSE(near.want(body_, nodes[4]));
  near.load(near.place_of(nodes[0]), Vec3(1.0, 0.0, 0.0));
  near.begin_tick();
  for (std::size_t k = 5; k < 8; ++k) EXPECT_TRUE(near.want(body_, nodes[k]));
  EXPECT_GE(near.place_of(nodes[0]), 0) << "a loaded node stays";
  EXPECT_FALSE(near.want(body_, nodes[9]));
}

TEST_P(NearFieldTest, ForgetsWhatIsNotWantedForLong) {
  NearField near(body_, 30);
  const std::vector<Index> nodes = free_nodes(4);
  near.begin_tick();
  for (std::size_t k = 0; k < 20; ++k) near.want(body_, nodes[k]);
  for (int tick = 0; tick < 300; ++tick) {
    near.begin_tick();
    near.want(body_, nodes[7]);
  }
  EXPECT_EQ(near.count(), 1);
  EXPECT_EQ(near.node(0), nodes[7]);
}

/// put_on_stored_nodes of the forces that are here is what they load.
void expect_load_of(NearField& near) {
  std::vector<double> f;
  for (Index place = 0; place < near.count(); ++place)
    for (int axis = 0; axis < near.dimension(); ++axis) f.push_back(near.force(place)[axis]);
  NodalLoad stored(near.dimension(), static_cast<Index>(near.load().node.size()));
  near.put_on_stored_nodes(f, stored);
  EXPECT_TRUE(std::ranges::equal(stored.nodes(), near.load().nodes()));
  EXPECT_TRUE(std::ranges::equal(stored.forces(), near.load().forces()));
}

TEST_P(NearFieldTest, DisplacementIsThatOfTheGreensFunctions) {
  NearField near(body_, 20);
  const std::vector<Index> nodes = free_nodes(5);
  near.begin_tick();
  for (std::size_t k = 0; k < 6; ++k) near.want(body_, nodes[k]);
  for (const std::size_t k : {0U, 3U, 4U}) {
    near.load(near.place_of(nodes[k]), test::upright(GetParam(), 0.1, -0.2, 0.3 + static_cast<double>(k)));
    near.load(near.place_of(nodes[k]), test::upright(GetParam(), 0.1, 0.0, 0.0));
  }
  near.displace();
  EXPECT_EQ(near.load().nodes().size(), 3U);
  expect_load_of(near);
  for (std::size_t k = 6; k < 12; ++k) near.want(body_, nodes[k]);  // these come after the forces
  std::vector<double> u(static_cast<std::size_t>(body_.greens().order()));
  body_.greens().displacement(near.load().nodes(), near.load().forces(), u);
  for (std::size_t k = 0; k < 12; ++k) {
    const Vec3 expected = vector_at(u, GetParam(), stored(nodes[k]));
    EXPECT_GT(expected.norm(), 1e-6);
    EXPECT_LT((near.displacement(near.place_of(nodes[k])) - expected).norm(), 1e-13 * expected.norm());
  }
  near.unload();
  near.displace();
  EXPECT_EQ(near.load().nodes().size(), 0U);
  EXPECT_EQ(near.displacement(0), Vec3::Zero());
}

TEST_P(NearFieldTest, RetreatMakesAShareOfTheChange) {
  NearField near(body_, 20);
  const std::vector<Index> nodes = free_nodes(5);
  near.begin_tick();
  for (std::size_t k = 0; k < 6; ++k) near.want(body_, nodes[k]);
  const auto displacements = [&] {
    near.displace();
    std::vector<Vec3> u;
    u.reserve(static_cast<std::size_t>(near.count()));
    for (Index place = 0; place < near.count(); ++place) u.push_back(near.displacement(place));
    return u;
  };
  near.load(near.place_of(nodes[1]), test::upright(GetParam(), 0.4, 0.0, 1.0));
  const std::vector<Vec3> before = displacements();
  near.unload();
  near.load(near.place_of(nodes[2]), test::upright(GetParam(), 0.0, 0.0, -3.0));
  const std::vector<Vec3> after = displacements();
  near.retreat(0.25);
  const std::vector<Vec3> between = displacements();
  EXPECT_EQ(near.load().nodes().size(), 2U);
  for (std::size_t k = 0; k < between.size(); ++k)
    EXPECT_LT((between[k] - (0.75 * before[k] + 0.25 * after[k])).norm(), 1e-14 * after[k].norm());
}

// Where change after change is scaled down, what a tool has left behind would be loaded for ever.
TEST_P(NearFieldTest, RetreatLeavesNothingSmallBehind) {
  NearField near(body_, 20);
  const std::vector<Index> nodes = free_nodes(5);
  const auto at = [&](std::size_t k) { return near.place_of(nodes[k]); };
  near.begin_tick();
  for (std::size_t k = 0; k < 3; ++k) near.want(body_, nodes[k]);
  near.load(at(0), test::upright(GetParam(), 0.0, 0.0, 0.5));
  near.load(at(1), test::upright(GetParam(), 0.0, 0.0, 2.0));
  near.begin_tick();
  for (std::size_t k = 1; k < 3; ++k) near.want(body_, nodes[k]);
  near.unload();
  near.load(at(2), test::upright(GetParam(), 0.0, 0.0, 1.0));
  near.retreat(0.999);
  EXPECT_EQ(near.force(at(0)), Vec3::Zero());
  EXPECT_GT(near.force(at(1)).norm(), 0.0);
}

/// A group of nodes with weights and maps, two of its nodes left out.
struct Group {
  Group(const Body& body, Index group, unsigned seed)
      : number(group),
        members(body.aggregates().members(group)),
        weights(members.size()),
        maps(members.size()) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> entry(-1.0, 1.0);
    for (std::size_t k = 0; k < members.size(); ++k) {
      weights[k] = k == 1 || k == members.size() - 1 ? 0.0 : 1.0 + entry(random);
      for (double& value : maps[k].reshaped()) value = entry(random);
    }
  }

  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t k = 0; k < members.size(); ++k) {
      if (weights[k] != 0.0) visit(members[k], maps[k]);
    }
  }

  Index number;
  std::span<const Index> members;
  std::vector<double> weights;
  std::vector<Eigen::Matrix3d> maps;
};

// A group's compliance is that of its members through their maps, whoever came first, and its force acts on
// them.
TEST_P(NearFieldTest, AGroupMovesAndIsLoadedThroughItsMembers) {
  const int d = GetParam();
  NearField near(body_, 60);
  const Group a(body_, 0, 3);
  const Group b(body_, body_.aggregates().count() - 1, 4);
  near.begin_tick();
  EXPECT_FALSE(near.want(body_, body_.aggregate_node(0))) << "its weights are not known";
  const std::vector<Index> others = free_nodes(8);
  near.want(body_, others[0]);
  for (const Group* group : {&a, &b}) {
    group->for_each([&](Index node, const Eigen::Matrix3d&) { ASSERT_TRUE(near.want(body_, node)); });
    ASSERT_TRUE(near.want_group(body_, group->number, group->weights, group->maps));
    EXPECT_TRUE(near.want(body_, body_.aggregate_node(group->number)));
    EXPECT_FALSE(near.want_group(body_, group->number, group->weights, group->maps))
        << "others have it in this tick";
  }
  for (std::size_t k = 1; k < 6; ++k) near.want(body_, others[k]);  // these come after the groups

  // J^T of a place: from its force to those on nodes.
  const auto nodes = static_cast<Index>(body_.surface_stored_nodes().size());
  const auto of_place = [&](Index place) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(body_.greens().order(), d);
    const Index node = near.node(place);
    if (node < nodes) J.middleRows(Eigen::Index{d} * stored(node), d).setIdentity();
    for (const Group* group : {&a, &b}) {
      if (node != body_.aggregate_node(group->number)) continue;
      group->for_each([&](Index member, const Eigen::Matrix3d& map) {
        J.middleRows(Eigen::Index{d} * stored(member), d) = map.topLeftCorner(d, d);
      });
    }
    return J;
  };
  Eigen::MatrixXd Xi(body_.greens().order(), body_.greens().order());
  for (Index i = 0; i < body_.greens().nodes(); ++i) {
    for (Index j = 0; j < body_.greens().nodes(); ++j)
      Xi.block(Eigen::Index{d} * i, Eigen::Index{d} * j, d, d) = body_.greens().block(i, j);
  }
  const auto expect_exact = [&] {
    for (Index i = 0; i < near.count(); ++i) {
      for (Index j = 0; j < near.count(); ++j) {
        const Eigen::MatrixXd C = of_place(i).transpose() * Xi * of_place(j);
        for (int p = 0; p < d; ++p) {
          for (int q = 0; q < d; ++q)
            ASSERT_NEAR(near.row(d * i + p)[static_cast<std::size_t>(d * j + q)], C(p, q), 1e-13 * Xi(0, 0))
                << i << " " << j;
        }
      }
    }
  };
  expect_exact();

  near.load(near.place_of(body_.aggregate_node(a.number)), test::upright(d, 0.3, 0.0, -0.2));
  near.load(near.place_of(others[2]), test::upright(d, 0.1, 0.0, 0.4));
  near.displace();
  EXPECT_FALSE(near.want_group(body_, a.number, a.weights, a.maps)) << "it carries force";
  expect_load_of(near);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(Xi.rows());
  for (Index place = 0; place < near.count(); ++place) f += of_place(place) * near.force(place).head(d);
  const Eigen::VectorXd u = Xi * f;
  for (Index place = 0; place < near.count(); ++place)
    EXPECT_LT((near.displacement(place).head(d) - of_place(place).transpose() * u).norm(), 1e-13 * u.norm());
  std::vector<double> whole(static_cast<std::size_t>(Xi.rows()));
  body_.greens().displacement(near.load().nodes(), near.load().forces(), whole);
  EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(whole.data(), Xi.rows()) - u).norm(), 1e-13 * u.norm());

  // Another compliance, as live bodies have them.
  const Eigen::MatrixXd own = Xi;
  Xi = test::random_definite(Xi.rows(), 5);
  const Index places = near.count();
  near.change_compliance(body_, make_greens(test::pack(Xi, Precision::double_precision), d));
  EXPECT_EQ(near.count(), places);
  expect_exact();
  const Eigen::VectorXd by_other = Xi * f;
  for (Index place = 0; place < near.count(); ++place) {
    EXPECT_LT((near.displacement(place).head(d) - of_place(place).transpose() * by_other).norm(),
              1e-13 * by_other.norm());
  }

  // Others go, and the last places move.
  near.unload();
  near.displace();
  for (int tick = 0; tick < 600; ++tick) {
    near.begin_tick();
    b.for_each([&](Index node, const Eigen::Matrix3d&) { near.want(body_, node); });
    EXPECT_TRUE(near.want(body_, body_.aggregate_node(b.number)));
  }
  EXPECT_LT(near.place_of(body_.aggregate_node(a.number)), 0);
  near.want(body_, others[4]);
  expect_exact();
  Xi = own;
  near.change_compliance(body_, nullptr);
  expect_exact();
}

/// Contact points of a sphere that presses on the top: nearest points of all simplices of the surface that
/// are as near, by a search without tree, near field or margins.
TEST_P(NearFieldTest, ContactPointsAreTheNearestPointsOfTheDeformedSurface) {
  const double radius = GetParam() == 2 ? 0.2 : 0.4;  // less than three edges: larger ones touch nodes alone
  State state(body_, {.tools = {Tool{.radius = radius}}, .max_contacts = 64});
  ToolPose tool;
  for (int k = 0; k <= 120; ++k) {
    tool.position = test::upright(GetParam(), 0.47, 0.52, 1.05 + radius - 0.001 * std::min(k, 100));
    ASSERT_FALSE(has(step(body_, state, tool), StepStatus::capacity_full));
  }
  const auto d = static_cast<std::size_t>(GetParam());
  std::vector<double> u(static_cast<std::size_t>(body_.greens().order()));
  surface_displacement(body_, state, u);
  const auto position = [&](Index node) -> Vec3 {
    const Vec3 rest = body_.surface_rest_positions()[static_cast<std::size_t>(node)];
    return stored(node) < 0 ? rest : Vec3(rest + vector_at(u, GetParam(), stored(node)));
  };
  std::size_t touching = 0;
  for (std::size_t at = 0; at < body_.simplices().size(); at += d) {
    const Vec3 a = position(body_.simplices()[at]);
    const Vec3 b = position(body_.simplices()[at + 1]);
    const NearestPoint nearest =
        d == 2 ? nearest_on_line(tool.position, a, b)
               : nearest_on_triangle(tool.position, a, b, position(body_.simplices()[at + 2]));
    const double gap = std::sqrt(nearest.squared_distance) - radius;
    EXPECT_GT(gap, -1e-9) << "simplex " << at / d << " is in the tool";
    if (gap > 1e-9) continue;
    ++touching;
    const bool found =
        std::any_of(state.contacts().begin(), state.contacts().end(),
                    [&](const ContactPoint& c) { return (c.position - nearest.on_simplex).norm() < 1e-6; });
    EXPECT_TRUE(found) << "simplex " << at / d << " touches and is no contact";
  }
  EXPECT_GE(touching, 2U);
  for (const ContactPoint& c : state.contacts()) {
    for (const ContactPoint& other : state.contacts())
      EXPECT_TRUE(&c == &other || (c.position - other.position).norm() > 1e-6) << "twice the same";
  }
}

// With room for two, the two that would be deepest without the body giving way are kept.
TEST_P(NearFieldTest, TheDeepestContactsAreKept) {
  const auto contacts_with = [&](Index room) {
    State state(body_, {.tools = {Tool{.radius = 0.4}}, .max_contacts = room});
    ToolPose tool;
    for (int k = 0; k <= 60; ++k) {
      tool.position = test::upright(GetParam(), 0.47, 0.52, 1.42 - 0.001 * k);
      step(body_, state, tool);
    }
    return state;
  };
  const State all = contacts_with(64);
  const State few = contacts_with(2);
  ASSERT_GT(all.contacts().size(), 2U);
  EXPECT_EQ(few.contacts().size(), 2U);
  EXPECT_TRUE(has(few.status, StepStatus::capacity_full));
  EXPECT_GT(few.tools[0].wrench.force.norm(), 0.2 * all.tools[0].wrench.force.norm());
}

}  // namespace
}  // namespace palpate::near_field_test
