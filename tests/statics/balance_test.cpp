// Rest under loads, flow past the yield, and springs against Young's modulus.
#include "statics/balance.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include "formats/model.h"
#include "meshes/element.h"
#include "runtime/live/plastic_flow.h"
#include "tests/support/bodies/live_bodies.h"
#include "tests/support/bodies/springs.h"

namespace palpate::balance_test {
namespace {

using Eigen::VectorXd;

constexpr double length = 0.04, width = 0.02;

/// A bar along x that can be pulled without shear: planes of symmetry at x = 0, y = 0 and z = 0, its end
/// held.
LiveInput bar(ElementType type, double nu) {
  LiveInput input = test::live_block(type, Analysis::solid, nu);
  test::hold(
      input, [](const Vec3& x) { return x.x() < 1e-9 || x.x() > length - 1e-9; }, 1);
  test::hold(
      input, [](const Vec3& x) { return x.y() < 1e-9; }, 2);
  test::hold(
      input, [](const Vec3& x) { return x.z() < 1e-9; }, 4);
  return input;
}

/// x stretched evenly until the end is pulled by `by` [m].
void pull(const LiveBody& body, double by, VectorXd& x) {
  for (Eigen::Index k = 0; k < x.size(); k += 3) x[k] = body.rest()[k] * (1.0 + by / length);
}

/// What the end pulls with [N].
double end_force(const LiveBody& body, const VectorXd& x, std::span<const Mat3> plastic) {
  VectorXd f;
  internal_forces(body, x, plastic, f);
  double sum = 0.0;
  for (Eigen::Index k = 0; k < x.size(); k += 3) {
    if (body.rest()[k] > length - 1e-9) sum -= f[k];
  }
  return sum;
}

// Uniaxial stress of the neo-Hookean law, by its principal stretches: lateral stretch from zero stress,
// bisected.
double neo_hookean_stress(double E, double nu, double stretch) {
  const double mu = E / (2 * (1 + nu)), kappa = E / (3 * (1 - 2 * nu));
  const auto stress = [&](double across, bool along) {  // P_i = d psi / d lambda_i
    const double J = stretch * across * across, I1 = stretch * stretch + 2 * across * across,
                 g = std::pow(J, -2.0 / 3.0);
    const double mine = along ? stretch : across;
    return mu * g * (mine - I1 / (3 * mine)) + kappa * (J - 1) * J / mine;
  };
  double low = 0.3, high = 2.0;
  for (int k = 0; k < 200; ++k) {
    const double middle = 0.5 * (low + high);
    (stress(middle, false) > 0.0 ? high : low) = middle;
  }
  return stress(low, true);
}

TEST(Balance, NeoHookeanBarHasTheStressOfItsPrincipalStretches) {
  for (const ElementType type : {ElementType::tet4, ElementType::tet10}) {
    for (const double nu : {0.3, 0.45}) {
      const LiveBody body(bar(type, nu), {.law = LiveLaw::neo_hookean});
      for (const double stretch : {0.5, 0.8, 1.5, 2.5}) {
        VectorXd x = body.start();
        const VectorXd none = VectorXd::Zero(x.size());
        for (int k = 1; k <= 4; ++k) {
          pull(body, k / 4.0 * (stretch - 1) * length, x);
          EXPECT_TRUE(find_balance(body, none, {}, x).converged);
        }
        EXPECT_NEAR(end_force(body, x, {}) / (neo_hookean_stress(5e3, nu, stretch) * width * width), 1.0,
                    1e-8)
            << traits(type).name << " " << stretch;
      }
    }
  }
}

TEST(Balance, CorotationalBarIsHookeanAtAnyStretch) {
  const LiveBody body(bar(ElementType::tet4, 0.3), {.law = LiveLaw::corotational});
  for (const double stretch : {0.6, 1.0001, 1.8}) {
    VectorXd x = body.start();
    pull(body, (stretch - 1) * length, x);
    EXPECT_TRUE(find_balance(body, VectorXd::Zero(x.size()), {}, x).converged);
    // P_11 = E (stretch - 1) where P_22 = P_33 = 0.
    EXPECT_NEAR(end_force(body, x, {}), 5e3 * (stretch - 1) * width * width, 1e-9);
  }
}

// A file's loads have the forces of initial strain among them, which the laws know by themselves: by small
// strain the forces alone do the same.
TEST(Balance, AFilesInitialStrainActsOnce) {
  for (const ElementType type : {ElementType::quad4, ElementType::tet4}) {
    LiveInput by_forces = test::live_block(type);
    test::hold(
        by_forces, [](const Vec3& x) { return x.x() < 1e-9; }, 7);
    Model model;
    model.mesh = by_forces.mesh;
    model.analysis = by_forces.analysis;
    model.thickness = by_forces.thickness;
    model.materials = by_forces.materials;
    model.materials[0].initial_strain = {0.01, -0.02, 0.0, 0.03, 0.0, 0.0};
    model.material_of_element = by_forces.material_of_element;
    model.fixed = by_forces.fixed;
    model.rest_force.assign(model.mesh.nodes.size(), Vec3(1e-4, 0.0, 0.0));
    const int d = model.dimension();
    const StressVector stress = initial_stress(model.materials[0], model.analysis);
    for (Index e = 0; e < model.mesh.elements(); ++e) {
      const ElementVector f =
          element_stress_force(model.mesh.element, element_nodes(model.mesh, e), stress, model.thickness);
      Eigen::Index k = 0;
      for (const Index node : model.mesh.element_nodes(e))
        model.rest_force[static_cast<std::size_t>(node)].head(d) += f.segment(d * k++, d);
    }
    by_forces.load = model.rest_force;
    const LiveBody of_file(live_input(model), {.law = LiveLaw::linear}),
        of_forces(by_forces, {.law = LiveLaw::linear});
    VectorXd a = of_file.start(), b = of_forces.start();
    ASSERT_TRUE(find_balance(of_file, of_file.load(), {}, a).converged);
    ASSERT_TRUE(find_balance(of_forces, of_forces.load(), {}, b).converged);
    EXPECT_GT((b - of_forces.rest()).lpNorm<Eigen::Infinity>(), 1e-4);
    EXPECT_LT((a - b).lpNorm<Eigen::Infinity>(), 1e-11);
  }
}

TEST(Balance, ACrumpledBodyFindsBackToRest) {
  for (const LiveLaw law : {LiveLaw::corotational, LiveLaw::neo_hookean}) {
    LiveInput input = test::live_block(ElementType::tet4);
    test::hold(
        input, [](const Vec3& x) { return x.x() < 1e-9; }, 7);
    const LiveBody body(input, {.law = law});
    VectorXd x = test::shaken(body, 5e-3, 4), f;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      if (body.free_of_dof()[static_cast<std::size_t>(k)] < 0) x[k] = body.start()[k];
    }
    EXPECT_GT(internal_forces(body, x, {}, f).inverted, 0);
    const double before = (x - body.rest()).norm();
    const BalanceReport report =
        find_balance(body, VectorXd::Zero(x.size()), {}, x, {.tolerance = 1e-14, .most_steps = 300});
    EXPECT_TRUE(report.converged) << name_of(law) << " " << report.residual;
    EXPECT_EQ(report.inverted, 0);
    EXPECT_LT((x - body.rest()).norm(), 1e-6 * before);
  }
}

// Along the bar's axis the elastic strain is a diag(1, -nu, -nu) of size n a. Held at a + p = e, a flows
// towards y / n: p(t) = (e - y / n) (1 - exp(-creep t)), whatever the steps; let go, p stays.
TEST(Flow, ABarPulledPastItsYieldKeepsTheSetOfTheRule) {
  const double nu = 0.3, e = 0.05, y = 0.02, creep = 3.0, n = std::sqrt(1.0 + 2.0 * nu * nu);
  for (const ElementType type : {ElementType::tet4, ElementType::tet10}) {
    for (const int steps : {5, 40}) {
      const LiveBody body(bar(type, nu), {.plasticity = {.yield = y, .creep = creep, .maximum = 1.0}});
      std::vector<Mat3> plastic(static_cast<std::size_t>(body.all_points()), Mat3::Zero());
      VectorXd x = body.start();
      pull(body, e * length, x);
      const double time = 0.4;
      double work = 0.0;
      for (int k = 0; k < steps; ++k) {
        ASSERT_TRUE(find_balance(body, VectorXd::Zero(x.size()), plastic, x).converged);
        work += flow(body, x, time / steps, plastic).work;
      }
      const double set = (e - y / n) * (1.0 - std::exp(-creep * time));
      LiveInput free = bar(type, nu);
      test::hold(
          free, [](const Vec3&) { return false; }, 0);
      for (std::size_t node = 0; node < free.fixed.size(); ++node) {
        if (free.mesh.nodes[node].x() > length - 1e-9) free.fixed[node] &= static_cast<std::uint8_t>(~1U);
      }
      const LiveBody released(free, body.options());
      ASSERT_TRUE(find_balance(released, VectorXd::Zero(x.size()), plastic, x).converged);
      for (Eigen::Index k = 0; k < x.size(); k += 3) {
        if (body.rest()[k] > length - 1e-9) {
          EXPECT_NEAR((x[k] - length) / length / set, 1.0, 1e-6);
        }
        if (body.rest()[k + 1] > width - 1e-9) {
          EXPECT_NEAR((x[k + 1] - width) / width / (-nu * set), 1.0, 1e-6);
        }
      }
      EXPECT_GT(work, 0.0);
    }
  }
}

TEST(Flow, StaysBelowItsMaximumAndBelowTheYieldNothingFlows) {
  const LiveBody body(bar(ElementType::tet4, 0.3),
                      {.plasticity = {.yield = 0.02, .creep = 50.0, .maximum = 0.03}});
  std::vector<Mat3> plastic(static_cast<std::size_t>(body.all_points()), Mat3::Zero());
  VectorXd x = body.start();
  pull(body, 0.015 * length, x);
  ASSERT_TRUE(find_balance(body, VectorXd::Zero(x.size()), plastic, x).converged);
  EXPECT_EQ(flow(body, x, 1.0, plastic).flowing, 0);
  pull(body, 0.2 * length, x);
  for (int k = 0; k < 30; ++k) {
    ASSERT_TRUE(find_balance(body, VectorXd::Zero(x.size()), plastic, x).converged);
    EXPECT_EQ(flow(body, x, 0.1, plastic).flowing, body.all_points());
  }
  for (const Mat3& strain : plastic) EXPECT_NEAR(strain.norm(), 0.03, 1e-12);
}

TEST(Flow, AClosedCycleTakesWork) {
  const double y = 0.02;
  const LiveBody body(bar(ElementType::tet4, 0.3),
                      {.plasticity = {.yield = y, .creep = 20.0, .maximum = 0.5}});
  std::vector<Mat3> plastic(static_cast<std::size_t>(body.all_points()), Mat3::Zero());
  VectorXd x = body.start();
  const auto at = [&](int k) { return 0.06 * length * std::sin(2 * M_PI * k / 200.0); };
  double by_end = 0.0, by_rule = 0.0, force = 0.0, of_cycle = 0.0, stored = 0.0;
  for (int k = 0; k <= 600; ++k) {
    pull(body, at(k), x);
    ASSERT_TRUE(find_balance(body, VectorXd::Zero(x.size()), plastic, x).converged);
    const double now = end_force(body, x, plastic);
    if (k > 0) by_end += 0.5 * (force + now) * (at(k) - at(k - 1));
    const FlowSums sums = flow(body, x, 0.01, plastic);
    by_rule += sums.work;
    force = end_force(body, x, plastic);  // after it has flowed
    VectorXd f;
    if (k == 400) {
      of_cycle = by_end;
      by_rule = 0.0;
      stored = internal_forces(body, x, plastic, f).energy;
    }
    if (k == 600) stored = internal_forces(body, x, plastic, f).energy - stored;
    EXPECT_GE(sums.work, 0.0);
  }
  of_cycle = by_end - of_cycle;
  EXPECT_GT(of_cycle, 0.0);
  EXPECT_NEAR(of_cycle / (by_rule + stored), 1.0, 1e-6);
}

/// A cube of tet4 between planes of symmetry, both its ends along x held.
LiveInput held_cube(double nu) {
  LiveInput input = test::live_input_of(generate(BoxShape{Vec3::Zero(), Vec3::Constant(0.03), {6, 6, 6}}),
                                        {.youngs_modulus = 5e3, .poissons_ratio = nu});
  test::hold(
      input, [](const Vec3& x) { return x.x() < 1e-9 || x.x() > 0.03 - 1e-9; }, 1);
  test::hold(
      input, [](const Vec3& x) { return x.y() < 1e-9; }, 2);
  test::hold(
      input, [](const Vec3& x) { return x.z() < 1e-9; }, 4);
  return input;
}

constexpr double strain = 1e-6;  // by which the cube is pulled

VectorXd pulled_cube(const LiveBody& body) {
  VectorXd x = body.start();
  for (Eigen::Index k = 0; k < x.size(); k += 3) {
    if (body.rest()[k] > 0.03 - 1e-9) x[k] += strain * 0.03;
  }
  return x;
}

/// E and nu that the pulled cube shows, at x with the forces f on its nodes.
Eigen::Vector2d shown_constants(const LiveBody& body, const VectorXd& x, const VectorXd& f) {
  double force = 0.0, across = 0.0;
  int nodes = 0;
  for (Eigen::Index k = 0; k < x.size(); k += 3) {
    if (body.rest()[k] > 0.03 - 1e-9) force -= f[k];
    if (body.rest()[k + 1] < 0.03 - 1e-9) continue;
    across += (x[k + 1] - body.rest()[k + 1]) / 0.03;
    ++nodes;
  }
  return {force / (0.03 * 0.03) / strain, -across / nodes / strain};
}

TEST(Springs, HaveAboutYoungsModulusAndAPoissonsRatioOfTheirOwn) {
  for (const double nu : {0.0, 0.45}) {
    const LiveBody body(held_cube(nu), {.law = LiveLaw::corotational});
    const VectorXd none = VectorXd::Zero(body.dofs());
    VectorXd by_elements = pulled_cube(body), by_springs = by_elements, f;
    EXPECT_TRUE(find_balance(body, none, {}, by_elements, {.tolerance = 1e-8}).converged);
    internal_forces(body, by_elements, {}, f);
    const Eigen::Vector2d elements = shown_constants(body, by_elements, f);
    EXPECT_NEAR(elements[0], 5e3, 0.1);
    EXPECT_NEAR(elements[1], nu, 1e-5);
    const std::vector<test::Spring> springs = test::fitted_springs(body.mesh(), 5e3);
    EXPECT_LT(find_balance(springs, body, none, by_springs), 1e-8);
    const Eigen::Vector2d network = shown_constants(body, by_springs, test::forces_of(springs, by_springs).f);
    EXPECT_NEAR(network[0] / 5e3, 1.0, 0.25);  // Kuhn's mesh is not the same in all directions
    EXPECT_NEAR(network[1], 0.25, 0.2);
  }
}

// The sum over all directions is what the fit rests on: 6 E V.
TEST(Springs, TheirSumIsThatOfAnEvenNetwork) {
  double sum = 0.0;
  for (const test::Spring& spring : test::fitted_springs(test::live_block(ElementType::tet4).mesh, 5e3))
    sum += spring.stiffness * spring.length * spring.length;
  EXPECT_NEAR(sum / (6.0 * 5e3 * length * width * width), 1.0, 1e-12);
}

}  // namespace
}  // namespace palpate::balance_test
