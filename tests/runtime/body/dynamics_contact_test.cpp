// Dynamic contact: the tool meets inertia and viscosity.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "runtime/background/motion_source.h"
#include "runtime/body/packed_newmark.h"
#include "tests/support/bodies/dynamics_sample.h"
#include "tests/support/bodies/make_dynamics.h"
#include "tests/support/runtime_tool.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::dynamics_contact_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::pose;

/// A body with dynamic contact and the loop around its ticks.
class Loop {
 public:
  Loop(Model model, const Tool& tool, int refinement = 1)
      : body(std::move(model), {}, refinement, ContactModel::dynamic),
        state(body, {.tools = {tool}, .tick = test::tick}) {
    if (body.model().dynamics.method == DynamicsMethod::packed)
      source.emplace(body, state, MotionSourceOptions{.in_background = false, .jobs = 1});
  }
  Vec3 step(const ToolPose& at) {
    if (source) source->receive(state);
    palpate::step(body, state, at);
    if (source) source->post(state);
    return state.tools.front().wrench.force;
  }

  Body body;
  State state;
  std::optional<MotionSource> source;
};

Vec3 shaken(int k) {
  const double t = k * test::tick;
  return {0.02 * std::sin(40.0 * t), 0.01 * (1.0 - std::cos(25.0 * t)), 0.03 * std::sin(15.0 * t)};
}

// A node of a cube that is shaken: against Newmark's method with the constraint u' = u_bar, solved densely.
// Of packed dynamics the node's velocity and acceleration are backward differences.
TEST(DynamicContact, IsTheConstrainedNewmarkStep) {
  const Model model = test::swinging_model(ElementType::tet4, test::packed());
  const test::SparseRoute sparse(model);
  const MatrixXd K_bar = effective_stiffness(sparse.equation.K, sparse.equation.M, model.dynamics.damping,
                                             model.dynamics.newmark);
  const MatrixXd inverse = test::inverse_of(K_bar);

  Loop loop(test::swinging_model(ElementType::tet4, test::packed()), test::plain({.reach = 0.5}));
  const Index held = loop.body.nearest_surface_node(Vec3(1.0, 1.0, 1.0)).node;
  const Vec3 at = loop.body.rest_position(held) + Vec3(0.001, 0.001, 0.001);
  Eigen::Vector3i dofs;
  for (int axis = 0; axis < 3; ++axis)
    dofs[axis] = static_cast<int>(sparse.stored_dofs[static_cast<std::size_t>(3 * held + axis)]);

  const Newmark h = model.dynamics.newmark;
  const VectorXd zero = VectorXd::Zero(K_bar.rows());
  VectorXd u = zero, v = zero, a = zero;
  const auto M = sparse.equation.M.selfadjointView<Eigen::Lower>();
  const auto C = sparse.equation.C.selfadjointView<Eigen::Lower>();
  loop.step(pose(at));
  double size = 0.0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 force = loop.step(pose(at + shaken(k), true));
    // Predict without force, then the force that the constraint takes.
    const VectorXd f_bar = M * VectorXd(h.a0() * u + h.a2() * v + h.a3() * a) +
                           C * VectorXd(h.a1() * u + h.a4() * v + h.a5() * a);
    const VectorXd predicted = inverse * f_bar;
    const Eigen::Vector3d f =
        inverse(dofs, dofs).llt().solve(Eigen::Vector3d(shaken(k) - Vec3(predicted(dofs))));
    VectorXd next = predicted;
    for (int axis = 0; axis < 3; ++axis) next += inverse.col(dofs[axis]) * f[axis];
    const VectorXd a_next = h.a0() * (next - u) - h.a2() * v - h.a3() * a;
    const VectorXd v_next = v + h.time_step * ((1.0 - h.delta) * a + h.delta * a_next);
    const Eigen::Vector3d driven = (next(dofs) - u(dofs)) / h.time_step;
    const Eigen::Vector3d pushed = (driven - v(dofs)) / h.time_step;
    u = next;
    v = v_next;
    a = a_next;
    v(dofs) = driven;
    a(dofs) = pushed;
    size = std::max(size, f.norm());
    ASSERT_LE((force + Vec3(f)).norm(), 3e-6 * size) << k;
    ASSERT_LE((test::displacement(loop.body, loop.state) - sparse.to_stored(u)).norm(), 3e-6 * u.norm()) << k;
  }
  EXPECT_GT(size, 0.0);
}

// The same of some modes, and static what they do not carry, by the dense modes themselves.
TEST(DynamicContact, IsTheConstrainedModalStep) {
  DynamicsOptions options = test::all_modes();
  options.modes = 60;
  const Model model = test::swinging_model(ElementType::tet4, options);
  Loop loop(model, test::plain({.reach = 0.5}));
  const Index held = loop.body.nearest_surface_node(Vec3(1.0, 1.0, 1.0)).node;
  const Vec3 at = loop.body.rest_position(held) + Vec3(0.001, 0.001, 0.001);
  const Eigen::Index k_modes = model.dynamics.modes();
  const Eigen::Map<const MatrixXd> Phi(model.dynamics.shapes.data(), model.stored_dofs(), k_modes);
  const VectorXd omega2 = Eigen::Map<const VectorXd>(model.dynamics.omega.data(), k_modes).array().square();
  const Newmark h = model.dynamics.newmark;
  const VectorXd c = model.dynamics.damping.mass + model.dynamics.damping.stiffness * omega2.array();
  const VectorXd k_bar = omega2.array() + h.a0() + h.a1() * c.array();
  MatrixXd compliance(model.stored_dofs(), 3);  // of the held dofs
  for (Eigen::Index i = 0; i < compliance.rows(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) compliance(i, axis) = model.greens(i, 3 * held + axis);
  }
  const MatrixXd at_node = Phi.middleRows<3>(3 * held);
  compliance += Phi * (k_bar.cwiseInverse() - omega2.cwiseInverse()).asDiagonal() * at_node.transpose();
  VectorXd q = VectorXd::Zero(k_modes), v = q, a = q;
  loop.step(pose(at));
  double size = 0.0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 force = loop.step(pose(at + shaken(k), true));
    const VectorXd predicted = ((h.a0() * q + h.a2() * v + h.a3() * a).array() +
                                c.array() * (h.a1() * q + h.a4() * v + h.a5() * a).array()) /
                               k_bar.array();
    const Eigen::Matrix3d C_bar = compliance.middleRows<3>(3 * held);
    const Eigen::Vector3d f = C_bar.llt().solve(Eigen::Vector3d(shaken(k) - Vec3(at_node * predicted)));
    const VectorXd u = Phi * predicted + compliance * f;
    const VectorXd next = predicted + (at_node.transpose() * f).cwiseQuotient(k_bar);
    const VectorXd a_next = h.a0() * (next - q) - h.a2() * v - h.a3() * a;
    v += h.time_step * ((1.0 - h.delta) * a + h.delta * a_next);
    q = next;
    a = a_next;
    size = std::max(size, f.norm());
    ASSERT_LE((force + Vec3(f)).norm(), 3e-6 * size) << k;
    ASSERT_LE((test::displacement(loop.body, loop.state) - u).norm(), 3e-6 * u.norm()) << k;
  }
  EXPECT_GT(size, 0.0);
}

// Damped, pushed slowly by a rigid ball and held: the static force, approached without bouncing off.
TEST(DynamicContact, SlowlyIsQuasiStatic) {
  for (const Index modes : {0, 5, 100}) {  // 0: packed
    DynamicsOptions options = modes == 0 ? test::packed() : test::all_modes();
    options.damping = {.mass = 20.0, .stiffness = 1e-4};
    if (modes > 0) options.modes = modes;
    const Model model = test::swinging_model(ElementType::tet4, options);
    Loop dynamic(model, test::plain({.radius = 0.3}));
    const Body body(model);
    State state(body, {.tools = {test::plain({.radius = 0.3})}});
    const Vec3 top = test::top_middle(3);
    Vec3 force = Vec3::Zero(), before = Vec3::Zero();
    double jump = 0.0;
    int losses = 0;
    bool touched = false;
    for (int k = 0; k <= 4000; ++k) {
      const ToolPose at = pose(top + Vec3(0.0, 0.0, 0.31 - 0.05 * std::min(k, 2000) / 2000.0));
      force = dynamic.step(at);
      step(body, state, at);
      jump = std::max(jump, (force - before).norm());
      before = force;
      const bool touches = dynamic.state.tools.front().contacts > 0;
      losses += touched && !touches ? 1 : 0;
      touched = touches;
    }
    const Vec3 expected = state.tools.front().wrench.force;
    ASSERT_GT(expected.norm(), 1e-3);
    EXPECT_LT((force - expected).norm(), 1e-3 * expected.norm()) << modes << " modes";
    EXPECT_LT(jump, 0.02 * expected.norm()) << modes << " modes";
    EXPECT_EQ(losses, 0) << modes << " modes";
  }
}

/// The work that a sinusoidal motion of a grabbed place does in its last two cycles, and the largest force in
/// them.
std::pair<double, double> shake(const Rayleigh& damping, double frequency) {
  DynamicsOptions options = test::all_modes();
  options.damping = damping;
  options.modes = 60;
  Loop loop(test::swinging_model(ElementType::tet4, options), test::plain({.reach = 0.5}));
  const Vec3 at = test::top_middle(3) + Vec3(0.0, 0.0, 0.001);
  loop.step(pose(at));
  const int cycle = static_cast<int>(std::lround(1.0 / (frequency * test::tick))),
            ticks = 2000 / cycle * cycle;
  double work = 0.0, largest = 0.0;
  Vec3 last = at, last_force = Vec3::Zero();
  for (int k = 0; k <= ticks; ++k) {
    const Vec3 now = at + Vec3(0.0, 0.0, 0.02 * std::sin(2.0 * std::numbers::pi * k / cycle));
    const Vec3 force = loop.step(pose(now, true));
    if (k > ticks - 2 * cycle) {
      work -= 0.5 * (force + last_force).dot(now - last);
      largest = std::max(largest, force.norm());
    }
    last = now;
    last_force = force;
  }
  return {work, largest};
}

// Viscosity takes work out of the hand, three times as much three times as much; inertia is felt as soon as
// the body cannot follow.
TEST(DynamicContact, FeelsInertiaAndViscosity) {
  const auto [work, force] = shake({.mass = 0.0, .stiffness = 2e-3}, 1.0);
  const auto [viscous_work, viscous_force] = shake({.mass = 0.0, .stiffness = 6e-3}, 1.0);
  EXPECT_GT(work, 0.0);
  EXPECT_NEAR(viscous_work, 3.0 * work, 0.02 * viscous_work);
  const auto [fast_work, fast_force] = shake({.mass = 0.0, .stiffness = 1e-4}, 40.0);
  EXPECT_GT(fast_force, 2.0 * force);
}

class Passivity : public testing::TestWithParam<std::tuple<bool, double, double>> {};

// A device with a hand's mass is thrown against the body: what comes back is never more than what went in. A
// spring that is felt once a tick gives k dt / 2 of negative damping (Colgate & Schenkel 1997): devices have
// at least that much friction of their own, which the observer counts.
TEST_P(Passivity, NothingIsGained) {
  const auto [is_packed, mass, stiffness] = GetParam();
  DynamicsOptions options = is_packed ? test::packed() : test::all_modes();
  if (!is_packed) options.modes = 30;
  options.damping = {};
  Model model = test::unit_model(ElementType::tet4, 3, Scope::full, Precision::double_precision);
  model.materials.front() = {.youngs_modulus = 5000.0, .poissons_ratio = 0.3, .density = 1000.0};
  for (Vec3& node : model.mesh.nodes) node *= 0.1;  // ten centimetres: K grows with E and the size
  MatrixXd Xi(model.greens.order(), model.greens.order());
  for (Eigen::Index i = 0; i < Xi.rows(); ++i) {
    for (Eigen::Index j = 0; j < Xi.cols(); ++j) Xi(i, j) = model.greens(i, j) / (5000.0 * 0.1);
  }
  model.greens = test::pack(Xi, Precision::double_precision);
  model.dynamics = test::make_dynamics(model, options, Precision::double_precision);
  const double friction = 0.5 * stiffness * test::tick;  // of the device [N s/m]
  Loop loop(std::move(model), {.radius = 0.02, .coupling_stiffness = stiffness});

  Vec3 x(0.05, 0.05, 0.125), v(0.02, 0.0, -0.3);
  double lost = 0.0, least = 0.0;
  int bounces = 0;
  bool touched = false;
  const double begin = 0.5 * mass * v.squaredNorm();
  for (int k = 0; k < 3000; ++k) {
    const Vec3 force = loop.step(pose(x)) - friction * v - Vec3(0.0, 0.0, mass * 2.0);  // and a weight
    v += test::tick / mass * force;
    const Vec3 moved = test::tick * v;
    lost += friction * v.squaredNorm() * test::tick;
    x += moved;
    const double kinetic = 0.5 * mass * v.squaredNorm(), potential = mass * 2.0 * (x.z() - 0.125);
    least = std::min(least, begin - kinetic - potential - lost);  // what the body has
    const bool touches = loop.state.tools.front().contacts > 0;
    bounces += touches && !touched ? 1 : 0;
    touched = touches;
    ASSERT_TRUE(std::isfinite(kinetic));
  }
  EXPECT_GE(bounces, 1);
  EXPECT_GT(least, -1e-3 * begin);
}

INSTANTIATE_TEST_SUITE_P(Devices, Passivity,
                         testing::Combine(testing::Bool(), testing::Values(0.05, 0.2, 1.0),
                                          testing::Values(100.0, 500.0, 2000.0)));

TEST(DynamicContact, NeedsDynamics) {
  EXPECT_THROW(Body(test::unit_model(ElementType::tet4, 2, Scope::full, Precision::double_precision), {}, 1,
                    ContactModel::dynamic),
               Error);
}

}  // namespace
}  // namespace palpate::dynamics_contact_test
