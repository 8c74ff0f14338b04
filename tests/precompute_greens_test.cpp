// Green's functions against the dense inverse.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "formats/model.h"
#include "formats/packed.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "precompute/greens.h"
#include "precompute/scope.h"

namespace palpate {
namespace {

constexpr Material soft{1.0e4, 0.45, 1000.0};

struct Body {
  Mesh mesh;
  Stiffness stiffness;

  template <class IsFixed>
  Body(const BoxShape& shape, IsFixed is_fixed) : mesh(generate(shape)) {
    std::vector<std::uint8_t> fixed;
    for (const Vec3& x : mesh.nodes) fixed.push_back(is_fixed(x) ? 1 : 0);
    stiffness = assemble_stiffness(mesh, soft, fixed);
  }
};

Body clamped_block() {
  return Body(BoxShape{Vec3::Zero(), Vec3(0.1, 0.08, 0.06), {6, 5, 4}},
              [](const Vec3& x) { return x.z() < 1e-9; });
}

/// Xi of the stored dofs by blocks of `width` columns, as a full matrix in the solver's order.
Eigen::MatrixXd greens(const GreensSolver& solver, std::int64_t width) {
  const std::int64_t n = solver.order();
  Eigen::MatrixXd Xi(n, n);
  GreensSolver::Workspace workspace;
  std::vector<double> packed;
  for (std::int64_t first = 0; first < n; first += width) {
    const std::int64_t count = std::min(width, n - first);
    solver.columns(first, count, workspace, packed);
    const double* entry = packed.data();
    for (std::int64_t j = first; j < first + count; ++j) {
      for (std::int64_t i = j; i < n; ++i) Xi(i, j) = Xi(j, i) = *entry++;
    }
    EXPECT_EQ(entry, packed.data() + packed.size());
  }
  return Xi;
}

/// The same block of the dense inverse of K.
Eigen::MatrixXd dense_inverse(const SparseMatrix& K, const std::vector<std::int64_t>& dofs) {
  const Eigen::MatrixXd full = Eigen::MatrixXd(K).selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd inverse = full.llt().solve(Eigen::MatrixXd::Identity(full.rows(), full.cols()));
  Eigen::MatrixXd block(static_cast<Eigen::Index>(dofs.size()), static_cast<Eigen::Index>(dofs.size()));
  for (std::size_t i = 0; i < dofs.size(); ++i) {
    for (std::size_t j = 0; j < dofs.size(); ++j) {
      block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = inverse(dofs[i], dofs[j]);
    }
  }
  return block;
}

void expect_inverse(const Body& body, Scope scope, Index layers, std::int64_t width) {
  Factor factor(body.stiffness.K);
  const GreensSolver solver(factor, stored_dof_marks(body.mesh, body.stiffness, scope, layers));
  factor.factorize();
  const Eigen::MatrixXd Xi = greens(solver, width),
                        reference = dense_inverse(body.stiffness.K, solver.stored_dofs());
  EXPECT_LT((Xi - reference).lpNorm<Eigen::Infinity>(), 1e-11 * reference.lpNorm<Eigen::Infinity>())
      << "scope " << static_cast<int>(scope) << ", " << layers << " layers, blocks of " << width;
}

TEST(Greens, EqualTheDenseInverseForEveryScopeAndBlockWidth) {
  const Body body = clamped_block();
  for (const std::int64_t width : {3, 24, 96, 100000}) {
    expect_inverse(body, Scope::surface, 0, width);
    expect_inverse(body, Scope::layers, 1, width);
    expect_inverse(body, Scope::full, 0, width);
  }
}

// A clamped slice cuts K into two parts that share no dof: the elimination tree is a forest.
TEST(Greens, BodyCutInTwoByAClampedSlice) {
  const Body body(BoxShape{Vec3::Zero(), Vec3(0.1, 0.05, 0.05), {6, 3, 3}},
                  [](const Vec3& x) { return std::abs(x.x() - 0.05) < 1e-9; });
  expect_inverse(body, Scope::surface, 0, 24);
  expect_inverse(body, Scope::full, 0, 24);
}

// Condensation (Fagerholt 3.49-3.51) is exact: what surface scope keeps is a block of what full scope keeps.
TEST(Greens, SurfaceScopeEqualsFullScope) {
  const Body body = clamped_block();
  Factor factor(body.stiffness.K);
  factor.factorize();
  const GreensSolver surface(factor, stored_dof_marks(body.mesh, body.stiffness, Scope::surface, 0));
  const GreensSolver full(factor, stored_dof_marks(body.mesh, body.stiffness, Scope::full, 0));
  const Eigen::MatrixXd Xi_surface = greens(surface, 48), Xi_full = greens(full, 48);
  const std::vector<std::int64_t> surface_dofs = surface.stored_dofs(), full_dofs = full.stored_dofs();
  ASSERT_LT(surface_dofs.size(), full_dofs.size());
  std::vector<Eigen::Index> place(full_dofs.size());
  for (std::size_t k = 0; k < full_dofs.size(); ++k) {
    place[static_cast<std::size_t>(full_dofs[k])] = static_cast<Eigen::Index>(k);
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < surface_dofs.size(); ++i) {
    for (std::size_t j = 0; j < surface_dofs.size(); ++j) {
      const double difference = Xi_surface(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) -
                                Xi_full(place[static_cast<std::size_t>(surface_dofs[i])],
                                        place[static_cast<std::size_t>(surface_dofs[j])]);
      largest = std::max(largest, std::abs(difference));
    }
  }
  EXPECT_LT(largest, 1e-10 * Xi_full.lpNorm<Eigen::Infinity>());
}

TEST(Greens, DofsOfANodeStayTogether) {
  const Body body = clamped_block();
  Factor factor(body.stiffness.K);
  const GreensSolver solver(factor, stored_dof_marks(body.mesh, body.stiffness, Scope::surface, 0));
  const std::vector<std::int64_t> dofs = solver.stored_dofs();
  for (std::size_t k = 0; k < dofs.size(); k += 3) {
    EXPECT_EQ(dofs[k] % 3, 0);
    EXPECT_EQ(dofs[k + 1], dofs[k] + 1);
    EXPECT_EQ(dofs[k + 2], dofs[k] + 2);
  }
}

}  // namespace
}  // namespace palpate
