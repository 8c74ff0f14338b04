// Held nodes against a direct solve, and what they refuse.
#include "runtime/body/prescribed_nodes.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/vectors.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::prescribed_nodes_test {
namespace {

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
  PrescribedNodes held(body, 40);
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
    ASSERT_EQ(held.hold(body, node), PrescribedStatus::ok);
    ASSERT_EQ(held.prescribe(node, prescribed), PrescribedStatus::ok);
  }
  ASSERT_EQ(held.solve(), PrescribedStatus::ok);
  Eigen::VectorXd u(body.greens().order());
  held.displace(body, {u.data(), static_cast<std::size_t>(u.size())});

  const DirectSolution direct = solve_directly(model, mesh_nodes, displacement);
  const double force_scale = direct.f.cwiseAbs().maxCoeff();
  const double displacement_scale = direct.u.cwiseAbs().maxCoeff();
  const Eigen::Map<const Eigen::VectorXd> forces(held.forces().data(), d * contacts);
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

/// A cube or, in the plane, a square, and its top's middle and corner.
class PrescribedNodesOnBody : public testing::TestWithParam<int> {
 protected:
  const Body body_{test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision)};
  PrescribedNodes held_{body_, 4};
  Index top_ = body_.nearest_surface_node(test::top_middle(GetParam())).node;
  Index corner_ = body_.nearest_surface_node(at(1.0, 1.0, 1.0)).node;

  /// The place or motion (x, y, z) with z up, in the plane (x, z).
  static Vec3 at(double x, double y, double z) { return test::upright(GetParam(), x, y, z); }

  [[nodiscard]] Vec3 force(const PrescribedNodes& held, Index node) const {
    return vector_at(held.forces(), GetParam(), held.position_of(node));
  }
  [[nodiscard]] Vec3 displacement(const PrescribedNodes& held, Index node) const {
    return vector_at(held.displacement(), GetParam(), held.position_of(node));
  }
  static std::vector<double> displace(const Body& body, const PrescribedNodes& held) {
    std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
    held.displace(body, u);
    return u;
  }
};

INSTANTIATE_TEST_SUITE_P(Dimension, PrescribedNodesOnBody, testing::Values(2, 3));

TEST_P(PrescribedNodesOnBody, StartsWithNothing) {
  EXPECT_EQ(held_.dimension(), GetParam());
  EXPECT_EQ(held_.count(), 0);
  EXPECT_TRUE(held_.nodes().empty() && held_.displacement().empty() && held_.forces().empty());
  EXPECT_EQ(held_.position_of(top_), -1);
  EXPECT_EQ(held_.solve(), PrescribedStatus::ok);
  EXPECT_EQ(displace(body_, held_), std::vector<double>(static_cast<std::size_t>(body_.greens().order())));
}

// One node: f is the inverse of its block of the Green's functions times u.
TEST_P(PrescribedNodesOnBody, OneNodeTakesTheForceOfItsBlock) {
  const Vec3 motion = at(0.001, -0.002, -0.01);
  ASSERT_EQ(held_.hold(body_, top_), PrescribedStatus::ok);
  EXPECT_EQ(force(held_, top_), Vec3::Zero()) << "taken where it is";
  ASSERT_EQ(held_.prescribe(top_, motion), PrescribedStatus::ok);
  EXPECT_EQ(force(held_, top_), Vec3::Zero()) << "not solved yet";
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  const Eigen::Map<const Eigen::VectorXd> u(motion.data(), GetParam());
  const Eigen::VectorXd f = body_.greens().block(top_, top_).inverse() * u;
  const Vec3 expected = vector_at({f.data(), static_cast<std::size_t>(f.size())}, GetParam(), 0);
  EXPECT_LT((force(held_, top_) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LT(force(held_, top_)[GetParam() - 1], 0.0) << "the body is pushed down";
}

// A node is taken where the others have pulled it to: no force, and theirs stay. Let go, it leaves no trace.
TEST_P(PrescribedNodesOnBody, AnotherNodeComesAndGoesWithoutTrace) {
  ASSERT_EQ(held_.hold(body_, corner_), PrescribedStatus::ok);
  ASSERT_EQ(held_.prescribe(corner_, at(0.0, 0.0, -0.02)), PrescribedStatus::ok);
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  const Vec3 alone = force(held_, corner_);
  const std::vector<double> u = displace(body_, held_);

  ASSERT_EQ(held_.hold(body_, top_), PrescribedStatus::ok);
  const Vec3 taken = displacement(held_, top_);
  EXPECT_GT(taken.norm(), 1e-5);
  EXPECT_LT((taken - vector_at(u, GetParam(), top_)).norm(), 1e-13 * taken.norm());
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  EXPECT_LT(force(held_, top_).norm(), 1e-13 * alone.norm());
  EXPECT_LT((force(held_, corner_) - alone).norm(), 1e-13 * alone.norm());

  ASSERT_EQ(held_.prescribe(top_, taken + at(0.01, 0.0, 0.0)), PrescribedStatus::ok);
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  EXPECT_GT(force(held_, top_).norm(), 1e-5);
  EXPECT_GT((force(held_, corner_) - alone).norm(), 1e-5);
  ASSERT_EQ(held_.release(top_), PrescribedStatus::ok);
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  ASSERT_EQ(held_.count(), 1);
  EXPECT_LT((force(held_, corner_) - alone).norm(), 1e-12 * alone.norm());
}

// Prescribed in another order than taken, and one of the middle let go: each node keeps its own numbers.
TEST_P(PrescribedNodesOnBody, NodesKeepTheirOwnNumbers) {
  const auto motion = [](Index node) { return at(0.001 * (node + 1), 0.002, -0.003 * (node + 1)); };
  for (const Index node : {0, 1, 2, 3}) ASSERT_EQ(held_.hold(body_, node), PrescribedStatus::ok);
  for (const Index node : {2, 0, 3, 1}) ASSERT_EQ(held_.prescribe(node, motion(node)), PrescribedStatus::ok);
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  for (const Index k : {0, 1, 2, 3}) EXPECT_EQ(vector_at(held_.displacement(), GetParam(), k), motion(k));
  std::vector<double> forces(held_.forces().begin(), held_.forces().end());

  ASSERT_EQ(held_.release(1), PrescribedStatus::ok);
  const auto second = forces.begin() + GetParam();
  forces.erase(second, second + GetParam());
  EXPECT_EQ(std::vector<double>(held_.forces().begin(), held_.forces().end()), forces);
  EXPECT_EQ(std::vector<Index>(held_.nodes().begin(), held_.nodes().end()), (std::vector<Index>{0, 2, 3}));
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  PrescribedNodes fresh(body_, 3);
  for (const Index node : {0, 2, 3}) {
    ASSERT_EQ(fresh.hold(body_, node), PrescribedStatus::ok);
    ASSERT_EQ(fresh.prescribe(node, motion(node)), PrescribedStatus::ok);
  }
  ASSERT_EQ(fresh.solve(), PrescribedStatus::ok);
  for (const Index node : {0, 2, 3}) {
    EXPECT_EQ(displacement(held_, node), displacement(fresh, node));
    const Vec3 expected = force(fresh, node);
    EXPECT_LT((force(held_, node) - expected).norm(), 1e-12 * expected.norm());
  }
}

TEST_P(PrescribedNodesOnBody, LetsGoOfAll) {
  for (const Index node : {top_, corner_}) ASSERT_EQ(held_.hold(body_, node), PrescribedStatus::ok);
  ASSERT_EQ(held_.prescribe(top_, at(0.0, 0.0, -0.01)), PrescribedStatus::ok);
  ASSERT_EQ(held_.solve(), PrescribedStatus::ok);
  held_.release_all();
  EXPECT_EQ(held_.count(), 0);
  EXPECT_EQ(displace(body_, held_), std::vector<double>(static_cast<std::size_t>(body_.greens().order())));
  ASSERT_EQ(held_.hold(body_, corner_), PrescribedStatus::ok);
  EXPECT_EQ(displacement(held_, corner_), Vec3::Zero());
  EXPECT_EQ(force(held_, corner_), Vec3::Zero());
}

TEST_P(PrescribedNodesOnBody, SaysWhatCannotBeHeld) {
  EXPECT_EQ(held_.hold(body_, -1), PrescribedStatus::no_such_node);
  EXPECT_EQ(held_.hold(body_, body_.greens().nodes()), PrescribedStatus::no_such_node);
  EXPECT_EQ(held_.release(3), PrescribedStatus::no_such_node);
  EXPECT_EQ(held_.prescribe(3, Vec3::Zero()), PrescribedStatus::no_such_node);
  for (Index node = 0; node < 4; ++node) ASSERT_EQ(held_.hold(body_, node), PrescribedStatus::ok);
  EXPECT_EQ(held_.hold(body_, 5), PrescribedStatus::full);
  EXPECT_EQ(held_.hold(body_, 0), PrescribedStatus::ok) << "held already";
  EXPECT_EQ(held_.count(), 4);
}

/// Green's functions in which nodes 0 and 1 are glued together.
Model glued_model(int dimension) {
  Model model = test::unit_model(dimension, 2, Scope::surface, Precision::double_precision);
  const PackedGreens exact = model.greens;
  const Eigen::Index n = exact.order();
  Eigen::MatrixXd glued(n, n);
  const auto first = [d = Eigen::Index{dimension}](Eigen::Index i) { return i / d == 1 ? i - d : i; };
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) glued(i, j) = exact(first(i), first(j));
  }
  model.greens = test::pack(glued, Precision::double_precision);
  return model;
}

TEST_P(PrescribedNodesOnBody, RefusesANodeThatDoesNotMoveOnItsOwn) {
  const Body body(glued_model(GetParam()));
  PrescribedNodes held(body, 4);
  ASSERT_EQ(held.hold(body, 0), PrescribedStatus::ok);
  ASSERT_EQ(held.prescribe(0, at(0.0, 0.0, -0.01)), PrescribedStatus::ok);
  ASSERT_EQ(held.solve(), PrescribedStatus::ok);
  const Vec3 alone = force(held, 0);
  EXPECT_EQ(held.hold(body, 1), PrescribedStatus::not_positive_definite);
  EXPECT_EQ(held.count(), 1);
  EXPECT_EQ(held.position_of(1), -1);
  ASSERT_EQ(held.solve(), PrescribedStatus::ok);
  EXPECT_EQ(force(held, 0), alone);
  EXPECT_EQ(held.hold(body, 2), PrescribedStatus::ok);
}

TEST_P(PrescribedNodesOnBody, KeepsTheLastForcesWhenTheNewOnesOverflow) {
  Model stiff = test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision);
  stiff.greens =
      test::pack(1e-9 * test::random_definite(stiff.stored_dofs(), 1), Precision::double_precision);
  const Body body(std::move(stiff));
  PrescribedNodes held(body, 4);
  ASSERT_EQ(held.hold(body, top_), PrescribedStatus::ok);
  ASSERT_EQ(held.prescribe(top_, at(0.0, 0.0, -0.01)), PrescribedStatus::ok);
  ASSERT_EQ(held.solve(), PrescribedStatus::ok);
  const Vec3 before = force(held, top_);
  ASSERT_EQ(held.prescribe(top_, Vec3::Constant(-1.7e308)), PrescribedStatus::ok);
  EXPECT_EQ(held.solve(), PrescribedStatus::result_not_finite);
  EXPECT_EQ(force(held, top_), before);
}

TEST_P(PrescribedNodesOnBody, CopiesGoTheirOwnWay) {
  ASSERT_EQ(held_.hold(body_, top_), PrescribedStatus::ok);
  ASSERT_EQ(held_.prescribe(top_, at(0.01, 0.0, -0.01)), PrescribedStatus::ok);
  PrescribedNodes copy = held_;
  for (PrescribedNodes* held : {&held_, &copy}) {
    ASSERT_EQ(held->hold(body_, corner_), PrescribedStatus::ok);
    ASSERT_EQ(held->solve(), PrescribedStatus::ok);
  }
  const std::vector<double> forces(held_.forces().begin(), held_.forces().end());
  EXPECT_EQ(std::vector<double>(copy.forces().begin(), copy.forces().end()), forces);
  copy.release_all();
  for (Index node = 0; node < 4; ++node)
    ASSERT_EQ(copy.hold(body_, node), PrescribedStatus::ok) << "room for four";
  EXPECT_EQ(std::vector<double>(held_.forces().begin(), held_.forces().end()), forces);
}

/// A body under loads rests elsewhere and feels the same.
TEST_P(PrescribedNodesOnBody, RestMovesTheBodyAndChangesNoForce) {
  Model model = test::unit_model(GetParam(), 4, Scope::surface, Precision::double_precision);
  test::set_rest(model, 0.5);
  const Body loaded(std::move(model));
  ASSERT_GT((loaded.rest_position(top_) - body_.rest_position(top_)).norm(), 0.5);
  PrescribedNodes held(loaded, 4);
  for (const auto& [body, contact] : {std::pair(&body_, &held_), std::pair(&loaded, &held)}) {
    ASSERT_EQ(contact->hold(*body, top_), PrescribedStatus::ok);
    EXPECT_EQ(displacement(*contact, top_), Vec3::Zero()) << "relative to rest";
    ASSERT_EQ(contact->prescribe(top_, at(0.0, 0.0, -0.02)), PrescribedStatus::ok);
    ASSERT_EQ(contact->solve(), PrescribedStatus::ok);
  }
  EXPECT_GT(force(held, top_).norm(), 1e-3);
  EXPECT_EQ(force(held, top_), force(held_, top_));
  EXPECT_EQ(displace(loaded, held), displace(body_, held_));
}

TEST(HeldPrecision, SingleDiffersFromDoubleByItsRounding) {
  Eigen::VectorXd forces[2];
  for (const bool single : {false, true}) {
    const Body body(test::unit_model(3, 4, Scope::surface,
                                     single ? Precision::single_precision : Precision::double_precision));
    PrescribedNodes held(body, 8);
    for (Index node = 0; node < 8; ++node) {
      ASSERT_EQ(held.hold(body, 5 * node), PrescribedStatus::ok);
      ASSERT_EQ(held.prescribe(5 * node, Vec3(0.0, 0.0, 0.001 * node)), PrescribedStatus::ok);
    }
    ASSERT_EQ(held.solve(), PrescribedStatus::ok);
    forces[single ? 1 : 0] = Eigen::Map<const Eigen::VectorXd>(held.forces().data(), 24);
  }
  const double difference = (forces[0] - forces[1]).norm() / forces[0].norm();
  EXPECT_LT(difference, 1e-5);  // 2^-24 times the condition number of C, about 20
  EXPECT_GT(difference, 1e-12) << "both were stored in the same precision";
}

TEST(PrescribedNodes, RefusesToBeBuiltWithoutRoom) {
  const Body body(test::unit_model(2, 2, Scope::surface, Precision::single_precision));
  for (const Index room : {0, -3}) {
    try {
      const PrescribedNodes held(body, room);
      FAIL() << "no room was taken";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("room for " + std::to_string(room) + " "), std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace palpate::prescribed_nodes_test
