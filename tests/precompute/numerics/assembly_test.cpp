// K against what elasticity says of it.
#include "precompute/numerics/assembly.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "meshes/element.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "precompute/numerics/factor.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::assembly_test {
namespace {

using test::ElasticCase;

const Material rubber{1.0e5, 0.4, 1000.0};

/// A box whose interior nodes are moved at random by up to 15 % of a cell.
Mesh distorted_box(int cells) {
  Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(0.3, 0.2, 0.25), {cells, cells, cells}});
  std::vector<std::uint8_t> on_surface(mesh.nodes.size(), 0);
  for (const Index node : extract_surface(mesh).nodes) on_surface[static_cast<std::size_t>(node)] = 1;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-0.15 * 0.2 / cells, 0.15 * 0.2 / cells);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!on_surface[node]) mesh.nodes[node] += Vec3(shift(random), shift(random), shift(random));
  }
  return mesh;
}

Eigen::MatrixXd dense(const SparseMatrix& lower) {
  return Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
}

TEST(Assembly, RigidMotionsTakeNoForce) {
  const Mesh mesh = distorted_box(3);
  const Eigen::MatrixXd K = dense(assemble_stiffness(ElasticCase(mesh, rubber).body()).K);
  Eigen::MatrixXd rigid(K.rows(), 6);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    const auto row = static_cast<Eigen::Index>(3 * node);
    const Vec3& x = mesh.nodes[node];
    rigid.block<3, 3>(row, 0).setIdentity();
    rigid.block<3, 3>(row, 3) << 0, x.z(), -x.y(), -x.z(), 0, x.x(), x.y(), -x.x(), 0;
  }
  EXPECT_LT((K * rigid).lpNorm<Eigen::Infinity>(), 1e-12 * K.lpNorm<Eigen::Infinity>());
  const Eigen::VectorXd eigenvalues = test::eigenvalues_of(K);
  EXPECT_LT(std::abs(eigenvalues[5]), 1e-10 * eigenvalues[eigenvalues.size() - 1]);
  EXPECT_GT(eigenvalues[6], 1e-5 * eigenvalues[eigenvalues.size() - 1]);
}

/// Energy of mu and of lambda up to 2 mu over edges and of the rest of lambda over nodes, of the strain
/// averaged there over each material.
double averaged_energy(const ElasticCase& body, const Eigen::VectorXd& u) {
  struct Sum {
    double volume = 0.0;
    Mat3 strain = Mat3::Zero();
  };
  std::map<std::array<Index, 3>, Sum> edges, nodes;
  for (Index e = 0; e < body.mesh.elements(); ++e) {
    const std::span<const Index> of = body.mesh.element_nodes(e);
    Mat3 sides, moved;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Index node = of[static_cast<std::size_t>(k + 1)];
      sides.col(k) =
          body.mesh.nodes[static_cast<std::size_t>(node)] - body.mesh.nodes[static_cast<std::size_t>(of[0])];
      moved.col(k) = u.segment<3>(3 * Eigen::Index{node}) - u.segment<3>(3 * Eigen::Index{of[0]});
    }
    const Mat3 slope = moved * sides.inverse(), strain = 0.5 * (slope + slope.transpose());
    const double volume = sides.determinant() / 6.0;
    const Index material = body.material_of_element[static_cast<std::size_t>(e)];
    const auto add = [&](Sum& sum, double share) {
      sum.volume += share * volume;
      sum.strain += share * volume * strain;
    };
    for (std::size_t i = 0; i < 4; ++i) {
      add(nodes[{material, of[i], of[i]}], 1.0 / 4.0);
      for (std::size_t j = i + 1; j < 4; ++j)
        add(edges[{material, std::min(of[i], of[j]), std::max(of[i], of[j])}], 1.0 / 6.0);
    }
  }
  double energy = 0.0;
  const auto add = [&](const auto& sums, bool is_of_edges) {
    for (const auto& [key, sum] : sums) {
      const Material& m = body.materials[static_cast<std::size_t>(key[0])];
      const double mu = m.youngs_modulus / (2.0 + 2.0 * m.poissons_ratio),
                   lambda = 2.0 * mu * m.poissons_ratio / (1.0 - 2.0 * m.poissons_ratio),
                   of_edges = std::min(lambda, 2.0 * mu);
      energy +=
          0.5 * (is_of_edges ? of_edges : lambda - of_edges) * std::pow(sum.strain.trace(), 2) / sum.volume;
      if (is_of_edges) energy += mu * sum.strain.squaredNorm() / sum.volume;
    }
  };
  add(edges, true);
  add(nodes, false);
  return energy;
}

TEST(Assembly, OfTet4aIsTheEnergyOfAveragedStrain) {
  ElasticCase body(with_elements(distorted_box(3), ElementType::tet4a, ""), rubber);
  body.materials.push_back({4.0e5, 0.2, 1000.0});
  for (std::size_t e = 0; e < body.material_of_element.size(); e += 3) body.material_of_element[e] = 1;
  const Eigen::MatrixXd K = dense(assemble_stiffness(body.body()).K);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd u = Eigen::VectorXd::NullaryExpr(K.rows(), [&] { return normal(random); });
    EXPECT_NEAR(0.5 * u.dot(K * u), averaged_energy(body, u), 1e-12 * averaged_energy(body, u));
  }
}

TEST(Assembly, ClampingThreeNodesMakesItPositiveDefinite) {
  ElasticCase box(distorted_box(2), rubber);
  box.fixed[0] = box.fixed[1] = box.fixed[3] = 7;
  const Eigen::MatrixXd K = dense(assemble_stiffness(box.body()).K);
  EXPECT_EQ(K.rows(), static_cast<Eigen::Index>(3 * (box.mesh.nodes.size() - 3)));
  EXPECT_GT(test::eigenvalues_of(K)[0], 0.0);
}

// Dofs held along some axes only: what is left is K without their rows and columns, and the held force is K
// times the prescribed displacements.
TEST(Assembly, PartlyHeldNodesAreLeftOutDofByDof) {
  ElasticCase box(distorted_box(2), rubber);
  const Eigen::MatrixXd full = dense(assemble_stiffness(box.body()).K);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(full.rows());
  box.fixed[0] = 7;
  box.fixed[5] = 2;
  box.fixed[9] = 5;
  box.prescribed[5] = Vec3(0.0, 3e-3, 0.0);
  box.prescribed[9] = Vec3(-2e-3, 0.0, 1e-3);
  u[16] = 3e-3;
  u[27] = -2e-3;
  u[29] = 1e-3;
  const Stiffness part = assemble_stiffness(box.body());
  const Eigen::VectorXd force = full * u;
  const Eigen::MatrixXd K = dense(part.K);
  ASSERT_EQ(K.rows(), full.rows() - 6);
  for (std::size_t i = 0; i < part.free_dofs.size(); ++i) {
    EXPECT_NEAR(part.held_force[i], force[part.free_dofs[i]], 1e-12 * force.lpNorm<Eigen::Infinity>());
    for (std::size_t j = 0; j < part.free_dofs.size(); ++j) {
      ASSERT_EQ(K(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                full(part.free_dofs[i], part.free_dofs[j]));
    }
  }
}

/// Tip deflection of a cantilever (clamped at x = 0) under a unit shear force spread over the tip as the
/// parabolic shear stress of Saint-Venant.
double cantilever_deflection(int cells_high, const Vec3& size, const Material& material) {
  const int along = cells_high * static_cast<int>(std::lround(size.x() / size.z()));
  const Mesh mesh = generate(BoxShape{Vec3::Zero(), size, {along, cells_high, cells_high}});
  const Stiffness stiffness = assemble_stiffness(
      ElasticCase(mesh, material).hold([](const Vec3& x) { return x.x() < 1e-9; }, 7).body());
  std::vector<double> f(static_cast<std::size_t>(stiffness.K.rows()), 0.0);
  const auto on_tip = [&](Index node) {
    return mesh.nodes[static_cast<std::size_t>(node)].x() > size.x() - 1e-9;
  };
  double total = 0.0;
  const Surface surface = extract_surface(mesh);
  for (Index facet = 0; facet < surface.count(); ++facet) {
    const std::span<const Index> nodes = surface.facet_nodes(facet);
    if (!std::all_of(nodes.begin(), nodes.end(), on_tip)) continue;
    const ShapeValues areas = facet_shape_integrals(surface.facet, positions(mesh, nodes), 1.0);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto node = static_cast<std::size_t>(nodes[i]);
      const double eta = 2.0 * mesh.nodes[node].z() / size.z() - 1.0;
      const double force = areas[static_cast<Eigen::Index>(i)] * (1.0 - eta * eta);
      f[static_cast<std::size_t>(stiffness.free_of_dof[3 * node + 2])] += force;
      total += force;
    }
  }
  for (double& force : f) force /= total;
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  const std::vector<double> u = factor.solve(f);
  double work = 0.0;  // of the unit force: the mean deflection in the sense of energy
  for (std::size_t dof = 0; dof < f.size(); ++dof) work += f[dof] * u[dof];
  return work;
}

/// Order of convergence seen on three meshes, each twice as fine as the one before.
double observed_order(double coarse, double middle, double fine) {
  return std::log2((middle - coarse) / (fine - middle));
}

// Timoshenko: w = P L^3 / (3 E I) + P L / (kappa G A), kappa = 5/6 for a rectangle at nu = 0, where
// Saint-Venant's solution has no Poisson effect at the clamp. Linear tetrahedra are too stiff in bending and
// converge from below. These meshes are not fine enough to show the final order 2 of the energy: 1.71 was
// measured here with up to 16 layers over the height, 1.86 on a beam of length 6 heights with up to 24 (too
// slow for a test). So the test holds that the order rises, the measured value, and the limit that order 2
// gives.
TEST(Assembly, CantileverConvergesToTimoshenko) {
  const Vec3 size(0.4, 0.1, 0.1);
  const Material material{1.0e6, 0.0, 1000.0};
  const double I = size.y() * std::pow(size.z(), 3) / 12.0, A = size.y() * size.z(),
               G = material.youngs_modulus / 2.0;
  const double timoshenko =
      std::pow(size.x(), 3) / (3.0 * material.youngs_modulus * I) + size.x() / (5.0 / 6.0 * G * A);
  const double w2 = cantilever_deflection(2, size, material), w4 = cantilever_deflection(4, size, material),
               w8 = cantilever_deflection(8, size, material), w16 = cantilever_deflection(16, size, material);
  EXPECT_LT(w2, w4);
  EXPECT_LT(w16, timoshenko);
  const double order = observed_order(w4, w8, w16);
  EXPECT_GT(order, observed_order(w2, w4, w8));
  EXPECT_NEAR(order, 1.7, 0.05);
  const double limit = w16 + (w16 - w8) / 3.0;  // Richardson with the final order 2
  EXPECT_NEAR(limit / timoshenko, 1.0, 0.003);
}

}  // namespace
}  // namespace palpate::assembly_test
