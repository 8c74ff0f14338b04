// The same body with other loads or of another stiffness.
#include "runtime/body/scaled_model.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"
#include "overlay/condensation.h"
#include "runtime/body/body.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::scaled_model_test {
namespace {

constexpr double scale = 2.5;

Model full_model(int dimension = 3) {
  return test::unit_model(dimension, dimension == 3 ? 3 : 6, Scope::full, Precision::double_precision);
}

/// K of the stored dofs by the elements and what the model's materials are now.
Eigen::MatrixXd stiffness_of(const Model& model) {
  const int d = model.dimension();
  std::vector<Eigen::Index> dofs;
  for (const Index node : model.stored_nodes) {
    for (int axis = 0; axis < d; ++axis) dofs.push_back(d * Eigen::Index{node} + axis);
  }
  return test::assemble_stiffness(model)(dofs, dofs);
}

class Scaled : public testing::TestWithParam<std::int64_t> {};

/// In the full square and packed.
INSTANTIATE_TEST_SUITE_P(Layouts, Scaled, testing::Values(-1, 0));

TEST_P(Scaled, GreensFunctionsAreThoseOfTheStifferElements) {
  Model model = full_model();
  scale_stiffness(model, scale);
  EXPECT_EQ(model.materials[0].youngs_modulus, scale);
  const Eigen::MatrixXd xi = stiffness_of(model).inverse();
  const std::shared_ptr<const Greens> made = make_greens(model.greens, 3, {.max_square_bytes = GetParam()});
  const Greens& greens = *made;
  ASSERT_EQ(greens.unfolded(), GetParam() < 0);
  const std::vector<Index> nodes = {3, 20};
  EXPECT_LT((greens.block(3, 20) - xi.block<3, 3>(9, 60)).norm(), 1e-11 * xi.norm());
  const std::vector<double> force = {1.0, -2.0, 0.5, 0.3, 0.0, 1.5};
  std::vector<double> u(static_cast<std::size_t>(greens.order()));
  greens.displacement(nodes, force, u);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(xi.rows());
  for (int k = 0; k < 6; ++k)
    f[3 * nodes[static_cast<std::size_t>(k / 3)] + k % 3] = force[static_cast<std::size_t>(k)];
  EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(u.data(), xi.rows()) - xi * f).norm(),
            1e-11 * (xi * f).norm());
}

/// What a ball is pressed back with that slides over the body.
std::vector<Vec3> forces_of(Model model) {
  const Body body(std::move(model));
  State state(body, {.tools = {Tool{.radius = 0.2, .friction = 0.3}}});
  std::vector<Vec3> forces;
  for (int k = 0; k < 200; ++k) {
    step(body, state, {.position = {0.3 + 0.001 * k, 0.5, 1.25 - 0.001 * std::min(k, 100)}});
    forces.push_back(state.tools[0].wrench.force);
  }
  return forces;
}

TEST(ScaledStiffness, ScalesTheForceOfTheSameWay) {
  const std::vector<Vec3> soft = forces_of(full_model());
  Model model = full_model();
  scale_stiffness(model, scale);
  const std::vector<Vec3> stiff = forces_of(std::move(model));
  EXPECT_GT(soft.back().norm(), 0.01);
  for (std::size_t k = 0; k < soft.size(); ++k)
    ASSERT_LT((stiff[k] - scale * soft[k]).norm(), 1e-6 * scale * soft.back().norm()) << k;
}

TEST(ScaledStiffness, HasTheOverlaysOfTheStifferBody) {
  for (const int d : {2, 3}) {
    Model model = full_model(d);
    model.overlay = {.refinement = 2, .rings = 1, .centres = {}, .patches = {}};
    const ElementsAtNodes at(model.mesh);
    const auto condensed = [&] {
      const Index node = model.surface.back();
      return condense(model, make_patch_mesh(model, at, rings_round(model.mesh, at, {&node, 1}, 1), 2));
    };
    model.overlay.patches.push_back(condensed());
    scale_stiffness(model, scale);
    const CondensedPatch& scaled = model.overlay.patches[0];
    const CondensedPatch expected = condensed();  // of the materials as they are now
    EXPECT_LT((scaled.G - expected.G).norm(), 1e-10 * expected.G.norm());
    EXPECT_LT((scaled.T - expected.T).norm(), 1e-10 * expected.T.norm());
    EXPECT_LT((scaled.compliance - expected.compliance).norm(), 1e-10 * expected.compliance.norm());
    EXPECT_GT(expected.G.norm(), 0.0);
  }
}

// K phi = omega^2 m phi of equal masses at all nodes.
TEST(ScaledStiffness, SwingsFaster) {
  constexpr double mass = 3.0;
  Model model = full_model(2);
  const auto frequencies = [&] {
    const Eigen::VectorXd lowest = (test::eigenvalues_of(stiffness_of(model)).head(4) / mass).cwiseSqrt();
    return std::vector<double>(lowest.begin(), lowest.end());
  };
  model.dynamics.method = DynamicsMethod::modal;
  model.dynamics.omega = frequencies();
  scale_stiffness(model, scale);
  const std::vector<double> expected = frequencies();
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(model.dynamics.omega[k], expected[k], 1e-9 * expected[k]);
}

TEST(ScaledStiffness, RefusesPackedDynamics) {
  Model model = full_model(2);
  model.dynamics.method = DynamicsMethod::packed;
  try {
    scale_stiffness(model, scale);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), "--stiffness-scale");
    EXPECT_NE(std::string(error.what()).find("packed dynamics"), std::string::npos);
  }
  EXPECT_NO_THROW(scale_stiffness(model, 1.0));
}

/// A body under forces, of which some act where it is held.
Model loaded_model() {
  Model model = full_model();
  for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node)
    model.rest_force[node] = Vec3(0.0, 0.001 * static_cast<double>(node), -0.01);
  Eigen::VectorXd f(3 * std::ssize(model.stored_nodes));
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k)
    f.segment<3>(3 * static_cast<Eigen::Index>(k)) =
        model.rest_force[static_cast<std::size_t>(model.stored_nodes[k])];
  const Eigen::VectorXd u = test::solved(stiffness_of(model), f);
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k)
    model.rest_displacement[static_cast<std::size_t>(model.stored_nodes[k])] =
        u.segment<3>(3 * static_cast<Eigen::Index>(k));
  return model;
}

/// |K u0 - f| of the free dofs, relative.
double imbalance(const Model& model) {
  Eigen::VectorXd f(3 * std::ssize(model.stored_nodes));
  Eigen::VectorXd u(f.size());
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k) {
    const auto node = static_cast<std::size_t>(model.stored_nodes[k]);
    f.segment<3>(3 * static_cast<Eigen::Index>(k)) = model.rest_force[node];
    u.segment<3>(3 * static_cast<Eigen::Index>(k)) = model.rest_displacement[node];
  }
  return (stiffness_of(model) * u - f).norm() / f.norm();
}

TEST(ScaledModel, StaysInBalance) {
  Model model = loaded_model();
  ASSERT_LT(imbalance(model), 1e-12);
  const double before = model.rest_displacement.back().norm();
  scale_loads(model, 0.3);
  EXPECT_LT(imbalance(model), 1e-12);
  EXPECT_NEAR(model.rest_displacement.back().norm(), 0.3 * before, 1e-12 * before);
  scale_stiffness(model, scale);
  EXPECT_LT(imbalance(model), 1e-12);
  EXPECT_NEAR(model.rest_displacement.back().norm(), 0.3 / scale * before, 1e-12 * before);
}

/// The last node, which is on top, is held where it was taken to.
Model prescribed_model(double displacement) {
  Model model = full_model();
  model.fixed.back() = 7;
  model.rest_displacement.back() = Vec3(0.0, 0.0, displacement);
  return model;
}

TEST(ScaledModel, KeepsWhatIsPrescribed) {
  Model model = prescribed_model(0.1);
  const std::vector<Vec3> before = model.rest_displacement;
  scale_stiffness(model, scale);
  EXPECT_EQ(model.rest_displacement, before);
  scale_loads(model, 0.5);
  EXPECT_EQ(model.rest_displacement.back(), Vec3(0.0, 0.0, 0.05));
}

TEST(ScaledModel, RefusesWhereItCannotTellForcesFromDisplacements) {
  for (const bool swells : {false, true}) {
    Model model = prescribed_model(swells ? 0.0 : 0.1);
    if (swells) model.materials[0].initial_strain[0] = 0.01;
    model.rest_force[static_cast<std::size_t>(model.stored_nodes[0])] = Vec3(0.0, 0.0, 0.1);
    try {
      Model copy = model;
      scale_stiffness(copy, scale);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.where(), "--stiffness-scale");
      EXPECT_NE(error.hint().find("--load-scale 0"), std::string::npos);
    }
    scale_loads(model, 0.0);
    EXPECT_NO_THROW(scale_stiffness(model, scale)) << "without loads there is nothing to tell";
    EXPECT_EQ(model.rest_displacement.back(), Vec3(Vec3::Zero()));
  }
}

}  // namespace
}  // namespace palpate::scaled_model_test
