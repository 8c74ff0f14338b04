// The tick against a direct solve, and what it does with tools that misbehave.
#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "meshes/error.h"
#include "runtime/node_vectors.h"
#include "runtime/step.h"
#include "tests/runtime_model.h"

namespace palpate {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The same static problem by elimination of the prescribed dofs in the sparse K: no Green's function
/// anywhere.
struct DirectSolution {
  Eigen::VectorXd u;  // [dN] displacement of all nodes
  Eigen::VectorXd f;  // [dN] force on all nodes
};

DirectSolution solve_directly(const Model& model, const std::vector<Index>& nodes,
                              const Eigen::VectorXd& displacement) {
  const auto d = static_cast<std::size_t>(model.dimension());
  const Eigen::MatrixXd K = test::assemble_stiffness(model);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(K.rows());
  std::vector<bool> known(static_cast<std::size_t>(K.rows()), false);
  for (std::size_t dof = 0; dof < known.size(); ++dof) known[dof] = model.fixed[dof / d] != 0;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    for (std::size_t axis = 0; axis < d; ++axis) {
      const std::size_t dof = d * static_cast<std::size_t>(nodes[k]) + axis;
      known[dof] = true;
      u[static_cast<Eigen::Index>(dof)] = displacement[static_cast<Eigen::Index>(d * k + axis)];
    }
  }
  std::vector<Eigen::Index> free;
  for (std::size_t dof = 0; dof < known.size(); ++dof) {
    if (!known[dof]) free.push_back(static_cast<Eigen::Index>(dof));
  }
  const Eigen::SparseMatrix<double> K_ff = Eigen::MatrixXd(K(free, free)).sparseView();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(K_ff);
  const Eigen::VectorXd load = K * u;
  const Eigen::VectorXd u_free = factor.solve(Eigen::VectorXd(-load(free)));
  u(free) = u_free;
  return {u, K * u};
}

struct DirectCase {
  ElementType element;
  int cells;
  Index contacts;
};

class DirectSolve : public testing::TestWithParam<DirectCase> {};

// The first issue's bound, 1e-9 of the largest value, for forces and for the displacement of all stored
// nodes.
TEST_P(DirectSolve, GivesTheForcesAndDisplacementsOfTheCapacitanceMatrixAlgorithm) {
  const Index contacts = GetParam().contacts;
  const Model model =
      test::unit_model(GetParam().element, GetParam().cells, Scope::full, Precision::double_precision);
  const Body body{Model(model)};
  const Eigen::Index d = body.dimension();
  State state(body, {.max_nodes = 40});
  std::mt19937 random(9);
  std::vector<Index> candidates = body.free_surface_nodes();
  std::shuffle(candidates.begin(), candidates.end(), random);
  std::vector<Index> mesh_nodes;
  Eigen::VectorXd displacement(d * contacts);
  std::uniform_real_distribution<double> entry(-0.01, 0.01);
  for (double& value : displacement) value = entry(random);
  for (Index k = 0; k < contacts; ++k) {
    const Index node = candidates[static_cast<std::size_t>(k)];
    const Eigen::VectorXd own = displacement.segment(d * k, d);
    const Vec3 prescribed(own[0], own[1], d == 3 ? own[2] : 0.3);  // z does not count in the plane
    mesh_nodes.push_back(body.mesh_node(node));
    ASSERT_EQ(hold(body, state, node), StepStatus::ok);
    ASSERT_EQ(prescribe(state, node, prescribed), StepStatus::ok);
  }
  ASSERT_EQ(solve(state), StepStatus::ok);
  Eigen::VectorXd u(body.greens().order());
  surface_displacement(body, state, {u.data(), static_cast<std::size_t>(u.size())});

  const DirectSolution direct = solve_directly(model, mesh_nodes, displacement);
  const double force_scale = direct.f.cwiseAbs().maxCoeff();
  const double displacement_scale = direct.u.cwiseAbs().maxCoeff();
  const Eigen::Map<const Eigen::VectorXd> forces(state.forces().data(), d * contacts);
  for (Index k = 0; k < contacts; ++k) {
    const Index node = mesh_nodes[static_cast<std::size_t>(k)];
    EXPECT_LE((forces.segment(d * k, d) - direct.f.segment(d * node, d)).norm(), 1e-9 * force_scale);
  }
  for (Index stored = 0; stored < body.greens().nodes(); ++stored) {
    const Index node = body.mesh_node(stored);
    EXPECT_LE((u.segment(d * stored, d) - direct.u.segment(d * node, d)).norm(), 1e-9 * displacement_scale);
  }
}

std::vector<DirectCase> direct_cases() {
  std::vector<DirectCase> cases;
  for (const Index contacts : {1, 5, 40}) {
    cases.push_back({ElementType::tet4, 5, contacts});
    cases.push_back({ElementType::quad4, 16, contacts});
    cases.push_back({ElementType::tri3, 16, contacts});
  }
  return cases;
}

std::string direct_name(const testing::TestParamInfo<DirectCase>& info) {
  return std::string(traits(info.param.element).name) + "_" + std::to_string(info.param.contacts);
}

INSTANTIATE_TEST_SUITE_P(Elements, DirectSolve, testing::ValuesIn(direct_cases()), direct_name);

/// A cube or, in the plane, a square and a tool above the middle of its top.
class Touch : public testing::TestWithParam<int> {
 protected:
  Body body_{test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision)};
  State state_{body_, {.reach = 0.1, .max_nodes = 4}};
  Index top_ = body_.nearest_surface_node(test::top_middle(GetParam())).node;
  Index corner_ = body_.nearest_surface_node(at(1.0, 1.0, 1.0)).node;
  Vec3 start_ = at(0.52, 0.5, 1.03);

  /// The place or motion (x, y, z) with z up, in the plane (x, z).
  static Vec3 at(double x, double y, double z) { return test::upright(GetParam(), x, y, z); }

  /// Force on the top that displaces it by `motion` when nothing else is held.
  [[nodiscard]] Vec3 force_alone(const Body& body, const Vec3& motion) const {
    const Eigen::Map<const Eigen::VectorXd> u(motion.data(), GetParam());
    const Eigen::VectorXd f = body.greens().block(top_, top_).inverse() * u;
    return vector_at({f.data(), static_cast<std::size_t>(f.size())}, GetParam(), 0);
  }
  [[nodiscard]] Vec3 first_force() const { return vector_at(state_.forces(), GetParam(), 0); }

  static ToolPose pose(const Vec3& position, bool grab) {
    ToolPose tool;
    tool.position = position;
    tool.grab = grab;
    return tool;
  }
};

TEST_P(Touch, GrabDoesNotKickAndTheNodeFollowsTheTool) {
  EXPECT_EQ(step(body_, state_, pose(start_, false)), StepStatus::ok);
  EXPECT_EQ(state_.tool_node, -1);
  EXPECT_EQ(step(body_, state_, pose(start_, true)), StepStatus::ok);
  EXPECT_EQ(state_.tool_node, top_);
  EXPECT_EQ(state_.tool_force, Vec3::Zero());

  const Vec3 motion = at(0.001, -0.002, -0.01);
  EXPECT_EQ(step(body_, state_, pose(start_ + motion, true)), StepStatus::ok);
  EXPECT_LT((state_.tool_node_displacement - motion).norm(), 1e-15);
  const Vec3 expected = force_alone(body_, motion);
  EXPECT_LT((state_.tool_force - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LT(state_.tool_force[GetParam() - 1], 0.0) << "the tool pushes the body down";
}

TEST_P(Touch, KeepsTheNodeWhereverItPullsUntilReleased) {
  step(body_, state_, pose(start_, true));
  step(body_, state_, pose(start_ + at(0.0, 0.0, 5.0), true));
  EXPECT_EQ(state_.tool_node, top_);
  EXPECT_EQ(step(body_, state_, pose(start_, false)), StepStatus::ok);
  EXPECT_EQ(state_.tool_node, -1);
  EXPECT_EQ(state_.nodes(), 0);
  EXPECT_EQ(state_.tool_force, Vec3::Zero());
  EXPECT_EQ(state_.tool_node_displacement, Vec3::Zero());
}

TEST_P(Touch, TakesHoldOnceItComesWithinReach) {
  const Vec3 far = at(0.5, 0.5, 1.2);
  EXPECT_EQ(step(body_, state_, pose(far, true)), StepStatus::nothing_in_reach);
  EXPECT_EQ(state_.tool_node, -1);
  EXPECT_EQ(step(body_, state_, pose(Vec3::Constant(1e300), true)), StepStatus::nothing_in_reach);
  EXPECT_EQ(step(body_, state_, pose(start_, true)), StepStatus::ok);
  EXPECT_EQ(state_.tool_node, top_);
}

TEST_P(Touch, HoldsTheLastValidResultWhenThePoseIsNotFinite) {
  step(body_, state_, pose(start_, true));
  step(body_, state_, pose(start_ - at(0.0, 0.0, 0.01), true));
  const Vec3 force = state_.tool_force;
  const Vec3 displacement = state_.tool_node_displacement;
  ToolPose turned = pose(start_, true);
  turned.orientation.w() = nan;
  for (const ToolPose& tool : {pose(Vec3(nan, 0.0, 0.0), true), pose(Vec3(0.0, nan, 0.0), false),
                               pose(Vec3(0.0, 0.0, std::numeric_limits<double>::infinity()), true), turned}) {
    EXPECT_EQ(step(body_, state_, tool), StepStatus::pose_not_finite);
    EXPECT_EQ(state_.tool_force, force);
    EXPECT_EQ(state_.tool_node_displacement, displacement);
    EXPECT_EQ(state_.tool_node, top_);
  }
  EXPECT_EQ(step(body_, state_, pose(start_, true)), StepStatus::ok);
  EXPECT_LT(state_.tool_force.norm(), 1e-14);
}

// So stiff a body that its force passes the largest number.
TEST_P(Touch, NeverGivesAForceThatIsNotFinite) {
  Model stiff = test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision);
  stiff.greens =
      test::pack(1e-6 * test::random_definite(stiff.stored_dofs(), 1) / 1e3, Precision::double_precision);
  const Body body(std::move(stiff));
  step(body, state_, pose(start_, true));
  step(body, state_, pose(start_ - at(0.0, 0.0, 0.01), true));
  const Vec3 force = state_.tool_force;
  const Vec3 displacement = state_.tool_node_displacement;
  EXPECT_EQ(step(body, state_, pose(Vec3::Constant(-1.7e308), true)), StepStatus::result_not_finite);
  EXPECT_EQ(state_.tool_force, force);
  EXPECT_EQ(state_.tool_node_displacement, displacement);
}

TEST_P(Touch, HeldNodesStayWhereTheyAreWhenTheToolComesAndGoes) {
  ASSERT_EQ(hold(body_, state_, corner_), StepStatus::ok);
  ASSERT_EQ(prescribe(state_, corner_, at(0.0, 0.0, -0.02)), StepStatus::ok);
  ASSERT_EQ(solve(state_), StepStatus::ok);
  const Vec3 alone = first_force();

  // The grabbed node is held where the corner has pulled it to: no force, and the corner's stays as it was.
  ASSERT_EQ(step(body_, state_, pose(start_, true)), StepStatus::ok);
  EXPECT_GT(state_.tool_node_displacement.norm(), 1e-5);
  EXPECT_LT(state_.tool_force.norm(), 1e-13 * alone.norm());
  EXPECT_LT((first_force() - alone).norm(), 1e-13 * alone.norm());

  ASSERT_EQ(step(body_, state_, pose(start_ + at(0.01, 0.0, 0.0), true)), StepStatus::ok);
  EXPECT_GT(state_.tool_force.norm(), 1e-5);
  ASSERT_EQ(step(body_, state_, pose(start_, false)), StepStatus::ok);
  ASSERT_EQ(state_.nodes(), 1);
  EXPECT_LT((first_force() - alone).norm(), 1e-12 * alone.norm());
}

// Prescribed in another order than taken, and one of the middle let go: each node keeps its own numbers.
TEST_P(Touch, NodesKeepTheirOwnNumbers) {
  const auto motion = [](Index node) { return at(0.001 * (node + 1), 0.002, -0.003 * (node + 1)); };
  for (const Index node : {0, 1, 2, 3}) ASSERT_EQ(hold(body_, state_, node), StepStatus::ok);
  for (const Index node : {2, 0, 3, 1}) ASSERT_EQ(prescribe(state_, node, motion(node)), StepStatus::ok);
  ASSERT_EQ(solve(state_), StepStatus::ok);
  for (const Index k : {0, 1, 2, 3}) EXPECT_EQ(vector_at(state_.prescribed(), GetParam(), k), motion(k));
  std::vector<double> forces(state_.forces().begin(), state_.forces().end());

  ASSERT_EQ(release(state_, 1), StepStatus::ok);
  forces.erase(forces.begin() + GetParam(), forces.begin() + 2 * GetParam());
  EXPECT_EQ(std::vector<double>(state_.forces().begin(), state_.forces().end()), forces);
  ASSERT_EQ(solve(state_), StepStatus::ok);
  State fresh(body_, {.max_nodes = 3});
  for (const Index node : {0, 2, 3}) {
    ASSERT_EQ(hold(body_, fresh, node), StepStatus::ok);
    ASSERT_EQ(prescribe(fresh, node, motion(node)), StepStatus::ok);
  }
  ASSERT_EQ(solve(fresh), StepStatus::ok);
  for (const Index k : {0, 1, 2}) {
    EXPECT_EQ(vector_at(state_.prescribed(), GetParam(), k), vector_at(fresh.prescribed(), GetParam(), k));
    const Vec3 expected = vector_at(fresh.forces(), GetParam(), k);
    EXPECT_LT((vector_at(state_.forces(), GetParam(), k) - expected).norm(), 1e-12 * expected.norm());
  }
}

TEST_P(Touch, SaysWhatCannotBeHeld) {
  EXPECT_EQ(hold(body_, state_, -1), StepStatus::no_such_node);
  EXPECT_EQ(hold(body_, state_, body_.greens().nodes()), StepStatus::no_such_node);
  EXPECT_EQ(release(state_, 3), StepStatus::no_such_node);
  EXPECT_EQ(prescribe(state_, 3, Vec3::Zero()), StepStatus::no_such_node);
  for (Index node = 0; node < 4; ++node)
    ASSERT_EQ(hold(body_, state_, node == top_ ? 4 : node), StepStatus::ok);
  EXPECT_EQ(hold(body_, state_, 5), StepStatus::capacity_full);
  EXPECT_EQ(step(body_, state_, pose(start_, true)), StepStatus::capacity_full);
  EXPECT_EQ(state_.tool_node, -1);
  EXPECT_EQ(hold(body_, state_, 0 == top_ ? 4 : 0), StepStatus::ok) << "held already";
  EXPECT_EQ(state_.nodes(), 4);
}

TEST_P(Touch, TheToolForgetsANodeThatSomebodyElseReleased) {
  step(body_, state_, pose(start_, true));
  ASSERT_EQ(release(state_, top_), StepStatus::ok);
  EXPECT_EQ(step(body_, state_, pose(start_, false)), StepStatus::ok);
  step(body_, state_, pose(start_, true));
  release_all(state_);
  EXPECT_EQ(state_.nodes(), 0);
  EXPECT_EQ(step(body_, state_, pose(start_, false)), StepStatus::ok);
}

bool same_bits(const Vec3& a, const Vec3& b) {
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (std::bit_cast<std::uint64_t>(a[axis]) != std::bit_cast<std::uint64_t>(b[axis])) return false;
  }
  return true;
}

// Copies are whole: a copy taken in the middle, with nodes held, goes the same way to the last bit.
TEST_P(Touch, CopiesReplayBitwise) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> move(-0.05, 0.05);
  std::vector<ToolPose> poses;
  poses.reserve(200);
  for (int k = 0; k < 200; ++k) {
    poses.push_back(pose(start_ + at(move(random), move(random), move(random)), k % 50 > 5));
  }
  hold(body_, state_, corner_);
  for (int k = 0; k < 20; ++k) step(body_, state_, poses[static_cast<std::size_t>(k)]);
  State copy = state_;
  for (const ToolPose& tool : poses) {
    ASSERT_EQ(step(body_, state_, tool), step(body_, copy, tool));
    ASSERT_TRUE(same_bits(state_.tool_force, copy.tool_force));
    ASSERT_TRUE(same_bits(state_.tool_node_displacement, copy.tool_node_displacement));
    ASSERT_EQ(state_.tool_node, copy.tool_node);
  }
}

INSTANTIATE_TEST_SUITE_P(Dimension, Touch, testing::Values(2, 3));

TEST(Plane, TheToolsHeightOverThePlaneDoesNotCount) {
  const Body body(test::unit_model(2, 4, Scope::surface, Precision::double_precision));
  State low(body, {.reach = 0.1});
  State high(body, {.reach = 0.1});
  ToolPose tool;
  tool.grab = true;
  for (const double depth : {0.0, 0.01, 0.03}) {
    tool.position = Vec3(0.52, 1.03 - depth, 0.0);
    ASSERT_EQ(step(body, low, tool), StepStatus::ok);
    tool.position.z() = 7.0 + depth;
    ASSERT_EQ(step(body, high, tool), StepStatus::ok);
    EXPECT_EQ(low.tool_node, high.tool_node);
    EXPECT_EQ(low.tool_force, high.tool_force);
    EXPECT_EQ(high.tool_node_displacement.z(), 0.0);
    EXPECT_EQ(high.tool_force.z(), 0.0);
  }
  EXPECT_GT(low.tool_force.norm(), 1e-3);
}

/// A body under loads rests elsewhere and feels the same.
class Rest : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, Rest, testing::Values(2, 3));

TEST_P(Rest, MovesTheBodyAndChangesNoForce) {
  Model model = test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision);
  const Body unloaded{Model(model)};
  test::set_rest(model, 0.5);
  const Body loaded(std::move(model));
  const Index top = unloaded.nearest_surface_node(test::top_middle(GetParam())).node;
  const Vec3 shift = loaded.rest_position(top) - unloaded.rest_position(top);
  ASSERT_GT(shift.norm(), 0.5) << "more than a cell: without u0 another node is the nearest";

  State there(unloaded, {.reach = 0.01});
  State here(loaded, {.reach = 0.01});
  ToolPose tool;
  tool.grab = true;
  for (const double depth : {0.0, 0.02}) {
    tool.position = unloaded.rest_position(top) - test::upright(GetParam(), 0.0, 0.0, depth);
    ASSERT_EQ(step(unloaded, there, tool), StepStatus::ok);
    tool.position += shift;
    ASSERT_EQ(step(loaded, here, tool), StepStatus::ok);
    ASSERT_EQ(here.tool_node, top);
    EXPECT_LT((here.tool_node_displacement - there.tool_node_displacement).norm(), 1e-15);
    EXPECT_LT((here.tool_force - there.tool_force).norm(), 1e-13 * (1.0 + there.tool_force.norm()));
  }
  EXPECT_GT(here.tool_force.norm(), 1e-3);
  Eigen::VectorXd u[2] = {Eigen::VectorXd(loaded.greens().order()), Eigen::VectorXd(loaded.greens().order())};
  surface_displacement(unloaded, there, {u[0].data(), static_cast<std::size_t>(u[0].size())});
  surface_displacement(loaded, here, {u[1].data(), static_cast<std::size_t>(u[1].size())});
  EXPECT_LT((u[1] - u[0]).norm(), 1e-13) << "u is relative to rest";

  State away(loaded, {.reach = 0.01});
  tool.position = unloaded.rest_position(top);
  EXPECT_EQ(step(loaded, away, tool), StepStatus::nothing_in_reach) << "the body has left this place";
}

TEST(Precision, SingleDiffersFromDoubleByItsRounding) {
  const Body exact(test::unit_model(3, 4, Scope::surface, Precision::double_precision));
  const Body rounded(test::unit_model(3, 4, Scope::surface, Precision::single_precision));
  Eigen::VectorXd forces[2];
  for (const bool single : {false, true}) {
    const Body& body = single ? rounded : exact;
    State state(body, {.max_nodes = 8});
    for (Index node = 0; node < 8; ++node) {
      ASSERT_EQ(hold(body, state, 5 * node), StepStatus::ok);
      prescribe(state, 5 * node, Vec3(0.0, 0.0, 0.001 * node));
    }
    ASSERT_EQ(solve(state), StepStatus::ok);
    forces[single ? 1 : 0] = Eigen::Map<const Eigen::VectorXd>(state.forces().data(), 24);
  }
  const double difference = (forces[0] - forces[1]).norm() / forces[0].norm();
  EXPECT_LT(difference, 1e-5);  // 2^-24 times the condition number of C, about 20
  EXPECT_GT(difference, 1e-12) << "both were stored in the same precision";
}

TEST(State, RefusesNonsense) {
  const Body body(test::unit_model(2, 2, Scope::surface, Precision::single_precision));
  EXPECT_THROW(State(body, {.reach = 0.0}), Error);
  EXPECT_THROW(State(body, {.reach = nan}), Error);
  EXPECT_THROW(State(body, {.max_nodes = 0}), Error);
  EXPECT_THROW(State(body, {.max_nodes = -3}), Error);
}

}  // namespace
}  // namespace palpate
