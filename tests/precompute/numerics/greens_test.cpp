// Green's functions against the dense inverse.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>

#include "formats/model.h"
#include "matrices/packed.h"
#include "meshes/generate.h"
#include "meshes/surface.h"
#include "precompute/numerics/greens_solver.h"
#include "precompute/numerics/scope.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::greens_test {
namespace {

const Material soft{1.0e4, 0.45, 1000.0};

struct Body {
  test::ElasticCase elastic;
  Stiffness stiffness;
  Surface surface;

  explicit Body(test::ElasticCase of)
      : elastic(std::move(of)),
        stiffness(assemble_stiffness(elastic.body())),
        surface(extract_surface(elastic.mesh)) {}

  [[nodiscard]] std::vector<std::uint8_t> marks(Scope scope, Index layers) const {
    return stored_dof_marks(elastic.mesh, surface, stiffness, scope, layers);
  }
};

bool at_bottom(const Vec3& x) {
  return x.z() < 1e-9;
}

Mesh block_mesh(ElementType element = ElementType::tet4) {
  return generate(BoxShape{Vec3::Zero(), Vec3(0.1, 0.08, 0.06), {6, 5, 4}}, element);
}

Body clamped_block() {
  return Body(test::ElasticCase(block_mesh(), soft).hold(at_bottom, 7));
}

enum class Blocks { ascending, descending };

/// Xi of the stored dofs by blocks of `width` columns with one workspace, as a full matrix in the solver's
/// order.
Eigen::MatrixXd greens(const GreensSolver& solver, std::int64_t width, Blocks blocks = Blocks::ascending) {
  const std::int64_t n = solver.order();
  Eigen::MatrixXd Xi(n, n);
  GreensSolver::Workspace workspace;
  std::vector<double> packed;
  for (std::int64_t k = 0, last = (n - 1) / width; k <= last; ++k) {
    const std::int64_t first = width * (blocks == Blocks::ascending ? k : last - k);
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
  const Eigen::MatrixXd inverse = test::inverse_of(full);
  Eigen::MatrixXd block(static_cast<Eigen::Index>(dofs.size()), static_cast<Eigen::Index>(dofs.size()));
  for (std::size_t i = 0; i < dofs.size(); ++i) {
    for (std::size_t j = 0; j < dofs.size(); ++j) {
      const bool held = dofs[i] < 0 || dofs[j] < 0;
      block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          held ? 0.0 : inverse(dofs[i], dofs[j]);
    }
  }
  return block;
}

void expect_inverse(const Body& body, Scope scope, Index layers, std::int64_t width) {
  Factor factor(body.stiffness.K, body.stiffness.node_start);
  const GreensSolver solver(factor, body.marks(scope, layers), body.stiffness.free_dofs,
                            body.elastic.mesh.dimension());
  factor.factorize();
  const Eigen::MatrixXd reference = dense_inverse(body.stiffness.K, solver.stored_dofs());
  for (const Blocks blocks : {Blocks::ascending, Blocks::descending}) {
    const Eigen::MatrixXd Xi = greens(solver, width, blocks);
    EXPECT_LT((Xi - reference).lpNorm<Eigen::Infinity>(), 1e-11 * reference.lpNorm<Eigen::Infinity>())
        << "scope " << static_cast<int>(scope) << ", " << layers << " layers, blocks of " << width
        << (blocks == Blocks::ascending ? "" : ", the last one first");
  }
}

TEST(Greens, EqualTheDenseInverseForEveryScopeAndBlockWidth) {
  const Body body = clamped_block();
  for (const std::int64_t width : {3, 24, 96, 100000}) {
    expect_inverse(body, Scope::surface, 0, width);
    expect_inverse(body, Scope::layers, 1, width);
    expect_inverse(body, Scope::full, 0, width);
  }
}

TEST(Greens, EqualTheDenseInverseForOtherElementsInThePlaneAndOnRollers) {
  const auto at_left = [](const Vec3& x) { return x.x() < 1e-9; };
  expect_inverse(Body(test::ElasticCase(block_mesh(ElementType::hex8), soft).hold(at_bottom, 7)),
                 Scope::surface, 0, 96);
  const Mesh tets = generate(BoxShape{Vec3::Zero(), Vec3(0.1, 0.08, 0.06), {3, 2, 2}});
  expect_inverse(
      Body(test::ElasticCase(with_elements(tets, ElementType::tet10, "test"), soft).hold(at_bottom, 7)),
      Scope::layers, 1, 96);
  expect_inverse(Body(test::ElasticCase(block_mesh(), soft).hold(at_bottom, 4).hold(at_left, 3)),
                 Scope::surface, 0, 96);
  for (const ElementType element : {ElementType::quad4, ElementType::tri3}) {
    const Mesh plate = generate(RectangleShape{Vec3::Zero(), Vec3(1.0, 1.0, 0.0), {9, 8}}, element);
    const Body body(test::ElasticCase(plate, soft).hold([](const Vec3& x) { return x.y() < 1e-9; }, 3));
    expect_inverse(body, Scope::surface, 0, 24);
    expect_inverse(body, Scope::full, 0, 24);
  }
}

TEST(Greens, NodesHeldAlongAnAxisAreStoredWholeWithZeros) {
  const Body body(test::ElasticCase(block_mesh(), soft)
                      .hold(at_bottom, 4)
                      .hold([](const Vec3& x) { return x.x() < 1e-9; }, 3));
  Factor factor(body.stiffness.K, body.stiffness.node_start);
  const GreensSolver solver(factor, body.marks(Scope::full, 0), body.stiffness.free_dofs, 3);
  const std::vector<std::int64_t> dofs = solver.stored_dofs();
  const auto whole = std::count_if(body.elastic.fixed.begin(), body.elastic.fixed.end(),
                                   [](std::uint8_t mask) { return mask != 7; });
  ASSERT_EQ(solver.order(), 3 * whole);
  for (std::size_t k = 0; k < dofs.size(); k += 3) {
    const std::int64_t some = std::max({dofs[k], dofs[k + 1], dofs[k + 2]});
    const std::int64_t node = body.stiffness.free_dofs[static_cast<std::size_t>(some)] / 3;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool held = (body.elastic.fixed[static_cast<std::size_t>(node)] >> axis & 1) != 0;
      EXPECT_EQ(dofs[k + axis] < 0, held) << "node " << node << ", axis " << axis;
      if (!held) {
        EXPECT_EQ(body.stiffness.free_dofs[static_cast<std::size_t>(dofs[k + axis])],
                  3 * node + static_cast<std::int64_t>(axis));
      }
    }
  }
}

// A clamped slice cuts K into two parts that share no dof: the elimination tree is a forest.
TEST(Greens, BodyCutInTwoByAClampedSlice) {
  const Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(0.1, 0.05, 0.05), {6, 3, 3}});
  const Body body(
      test::ElasticCase(mesh, soft).hold([](const Vec3& x) { return std::abs(x.x() - 0.05) < 1e-9; }, 7));
  expect_inverse(body, Scope::surface, 0, 24);
  expect_inverse(body, Scope::full, 0, 24);
}

// Condensation (Fagerholt 3.49-3.51) is exact: what surface scope keeps is a block of what full scope keeps.
TEST(Greens, SurfaceScopeEqualsFullScope) {
  const Body body = clamped_block();
  Factor factor(body.stiffness.K, body.stiffness.node_start);
  factor.factorize();
  const GreensSolver surface(factor, body.marks(Scope::surface, 0), body.stiffness.free_dofs, 3);
  const GreensSolver full(factor, body.marks(Scope::full, 0), body.stiffness.free_dofs, 3);
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
  Factor factor(body.stiffness.K, body.stiffness.node_start);
  const GreensSolver solver(factor, body.marks(Scope::surface, 0), body.stiffness.free_dofs, 3);
  const std::vector<std::int64_t> dofs = solver.stored_dofs();
  for (std::size_t k = 0; k < dofs.size(); k += 3) {
    EXPECT_EQ(dofs[k] % 3, 0);
    EXPECT_EQ(dofs[k + 1], dofs[k] + 1);
    EXPECT_EQ(dofs[k + 2], dofs[k] + 2);
  }
}

}  // namespace
}  // namespace palpate::greens_test
