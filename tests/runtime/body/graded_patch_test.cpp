// Graded, round patches: their geometry against the shapes that they follow, and their compliance against the
// body and the fine mesh solved as one dense system.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "meshes/element.h"
#include "meshes/generate.h"
#include "meshes/topology.h"
#include "runtime/body/make_patch.h"
#include "runtime/body/patch_maker.h"
#include "runtime/core/body/free_motion.h"
#include "runtime/core/body/near_field.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::graded_patch_test {
namespace {

using Eigen::MatrixXd;

/// Points (x, y) off the unit circle, on whose round side a point of the cylinder lies.
double off_circle(const Vec3& x) {
  return std::abs(std::hypot(x[0], x[1]) - 1.0);
}

TEST(Rounding, FollowsACylinderAndLeavesItsEndsFlat) {
  const Model model = test::round_model(3);
  const Rounding rounding(model.mesh);
  double worst_flat = 0.0, worst_round = 0.0;
  int on_the_side = 0, on_the_ends = 0;
  for (const ElementSide& side : boundary_sides(model.mesh)) {
    const std::vector<Index> corners = side_nodes(model.mesh, side);
    const std::vector<std::pair<Index, double>> middle = {
        {corners[0], 1.0 / 3.0}, {corners[1], 1.0 / 3.0}, {corners[2], 1.0 / 3.0}};
    const auto& x = model.mesh.nodes;
    const Vec3 flat = (x[corners[0]] + x[corners[1]] + x[corners[2]]) / 3.0;
    const auto at_end = [&](Index node) { return std::abs(x[node][2] - 0.5) > 0.5 - 1e-9; };
    const bool is_end = std::all_of(corners.begin(), corners.begin() + 3, at_end);
    if (is_end) {
      EXPECT_NEAR(rounding.offset(middle).norm(), 0.0, 1e-12);
      ++on_the_ends;
    } else if (std::none_of(corners.begin(), corners.begin() + 3, at_end)) {
      worst_flat = std::max(worst_flat, off_circle(flat));
      worst_round = std::max(worst_round, off_circle(flat + rounding.offset(middle)));
      ++on_the_side;
    }
  }
  EXPECT_GT(on_the_side, 20);
  EXPECT_GT(on_the_ends, 20);
  EXPECT_GT(worst_flat, 2e-3);  // h^2 / 24 of edges of 0.2 and more
  EXPECT_LT(worst_round, 0.1 * worst_flat);
}

TEST(Rounding, LeavesACubeAsItIs) {
  for (const ElementType element :
       {ElementType::tri3, ElementType::tet4, ElementType::tet10, ElementType::hex8}) {
    const Mesh mesh = test::unit_mesh(element, 2);
    const Rounding rounding(mesh);
    for (const ElementSide& side : boundary_sides(mesh)) {
      const std::vector<Index> nodes = side_nodes(mesh, side);
      const std::vector<std::pair<Index, double>> weights = {{nodes[0], 0.5}, {nodes[1], 0.5}};
      EXPECT_NEAR(rounding.offset(weights).norm(), 0.0, 1e-15) << traits(element).name;
    }
  }
}

// A middle node off the middle says what the surface is; it is not bent twice.
TEST(Rounding, KeepsEdgesThatAreCurvedAlready) {
  Mesh mesh = test::unit_mesh(ElementType::tet10, 1);
  for (Vec3& x : mesh.nodes) x *= 1.0 + 0.3 * (3.0 - x.sum());  // corners turn
  const Rounding rounding(mesh);
  for (const ElementSide& side : boundary_sides(mesh)) {
    const std::vector<Index> nodes = side_nodes(mesh, side);
    const Vec3 middle = 0.5 * (mesh.nodes[nodes[0]] + mesh.nodes[nodes[1]]);
    if ((mesh.nodes[nodes[3]] - middle).norm() < 1e-3) continue;
    const std::vector<std::pair<Index, double>> weights = {{nodes[0], 0.5}, {nodes[1], 0.5}};
    EXPECT_EQ(rounding.offset(weights).norm(), 0.0);
  }
}

struct Case {
  std::string name;
  ElementType element;  // of a unit cube or square
  bool is_round;        // a cylinder or half a ring in its place
};

class Graded : public testing::TestWithParam<Case> {
 protected:
  // Coarser on the cylinder, whose dense system would take long.
  const double finest = GetParam().name == "cylinder" ? 0.4 : 0.15;

  static Model model() {
    const Case& tested = GetParam();
    if (!tested.is_round)
      return test::unit_model(tested.element, tested.element == ElementType::tet10 ? 2 : 3, Scope::full,
                              Precision::double_precision);
    if (tested.element == ElementType::tet4) {
      return test::bake(
          generate(CylinderShape{.cells_across = 4, .cells_along = 3}),
          [](const Vec3& node) { return std::abs(node.z() - 0.5) > 0.5 - 1e-12; }, Scope::full,
          Precision::double_precision);
    }
    Mesh ring = test::unit_mesh(ElementType::tri3, 8);
    for (Vec3& node : ring.nodes) {
      const double angle = std::numbers::pi * (1.0 - node.x());
      node = 0.5 * (1.0 + node.y()) * Vec3(std::cos(angle), std::sin(angle), 0.0);
    }
    return test::bake(
        std::move(ring), [](const Vec3& node) { return node.norm() < 0.5 + 1e-12; }, Scope::full,
        Precision::double_precision);
  }

  Body body_{model(), {}, 3, ContactModel::quasi_static, true};
  ElementsAtNodes at_{body_.model().mesh};
  int d_ = body_.dimension();
  std::size_t width_ = static_cast<std::size_t>(d_);

  /// A node of the fine surface inside a facet that is not held.
  [[nodiscard]] Index centre() const {
    const FineSurface& fine = body_.fine_surface();
    for (Index node = fine.nodes(); node-- > 0;) {
      const auto& corners = fine.corners[static_cast<std::size_t>(node)];
      const auto is_free = [&](Index corner) { return corner >= 0 && body_.model().fixed[corner] == 0; };
      if (std::all_of(corners.begin(), corners.begin() + d_, is_free)) return node;
    }
    ADD_FAILURE() << "no facet is free";
    return 0;
  }

  [[nodiscard]] GradedMesh mesh() const {
    const auto& corners = body_.fine_surface().corners[static_cast<std::size_t>(centre())];
    const std::vector<Index> nodes(corners.begin(), corners.begin() + d_);
    return make_graded_mesh(body_.model(), at_, *body_.rounding(),
                            rings_round(body_.model().mesh, at_, nodes, 1),
                            {.points = {body_.flat_position(centre())}, .edge = finest});
  }

  /// Displacement of all surface nodes and of all stored nodes by forces on them [m/N].
  [[nodiscard]] MatrixXd reference(const PatchMesh& patch, const Patch& made) const {
    const Model& model = body_.model();
    std::vector<Index> all(static_cast<std::size_t>(body_.greens().nodes()));
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<Index>(k);
    const MatrixXd Xi = greens_at(body_, all);
    const Eigen::Index n = Xi.rows(), l = patch.free_dofs;
    // All dofs that the patch's local ones follow: u = F [u_stored, u_L].
    MatrixXd F = MatrixXd::Zero(d_ * std::ssize(patch.local.nodes), n + l);
    for (Eigen::Index dof = 0; dof < F.rows(); ++dof) {
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(patch.shape, dof / d_); it; ++it) {
        const Index node = patch.nodes[static_cast<std::size_t>(it.col())];
        if ((model.fixed[static_cast<std::size_t>(node)] >> (dof % d_) & 1) == 0)
          F(dof, d_ * body_.stored_node(node) + dof % d_) = it.value();
      }
      const Index free = patch.free_dof[static_cast<std::size_t>(dof)];
      if (free >= 0) F(dof, n + free) = 1.0;
    }
    MatrixXd K = MatrixXd::Zero(n + l, n + l);
    K.topLeftCorner(n, n) = Xi.inverse();
    const ElasticityMatrix D = elasticity_matrix(model.materials.front(), model.analysis);
    const auto add = [&](const Mesh& mesh, Index e, double sign, const auto& row_of) {
      const ElementMatrix K_e = element_stiffness(mesh.element, element_nodes(mesh, e), D, model.thickness);
      const auto nodes = mesh.element_nodes(e);
      MatrixXd rows(d_ * std::ssize(nodes), n + l);
      for (Eigen::Index dof = 0; dof < rows.rows(); ++dof)
        rows.row(dof) = row_of(nodes[static_cast<std::size_t>(dof / d_)], dof % d_);
      K += sign * rows.transpose() * MatrixXd(K_e) * rows;
    };
    for (Index e = 0; e < patch.local.elements(); ++e)
      add(patch.local, e, 1.0,
          [&](Index node, Eigen::Index axis) { return Eigen::RowVectorXd(F.row(d_ * node + axis)); });
    for (const Index e : patch.elements) {
      add(model.mesh, e, -1.0, [&](Index node, Eigen::Index axis) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n + l);
        const bool is_held = (model.fixed[static_cast<std::size_t>(node)] >> axis & 1) != 0;
        if (!is_held) row[d_ * body_.stored_node(node) + axis] = 1.0;
        return row;
      });
    }
    const auto m = std::ssize(body_.surface_rest_positions());
    MatrixXd E = MatrixXd::Zero(d_ * m + n, n + l);
    const std::vector<Index> fine = surface_nodes(patch);
    for (Index node = 0; node < m; ++node) {
      const auto found = std::lower_bound(made.surface_nodes().begin(), made.surface_nodes().end(), node);
      const bool is_in = found != made.surface_nodes().end() && *found == node;
      const SurfaceParts parts = body_.surface_parts(node);
      for (int axis = 0; axis < d_; ++axis) {
        for (std::size_t p = 0; !is_in && p < parts.stored.size(); ++p)
          E(d_ * node + axis, d_ * parts.stored[p] + axis) = parts.weights[p];
        if (!is_in) continue;
        made.for_each_part(
            static_cast<Index>(found - made.surface_nodes().begin()), [&](Index k, double weight) {
              E.row(d_ * node + axis) += weight * F.row(d_ * fine[static_cast<std::size_t>(k)] + axis);
            });
      }
    }
    E.bottomLeftCorner(n, n).setIdentity();
    return E * K.ldlt().solve(E.transpose());
  }
};

INSTANTIATE_TEST_SUITE_P(Bodies, Graded,
                         testing::Values(Case{"tri3", ElementType::tri3, false},
                                         Case{"tet4", ElementType::tet4, false},
                                         Case{"tet10", ElementType::tet10, false},
                                         Case{"ring", ElementType::tri3, true},
                                         Case{"cylinder", ElementType::tet4, true}),
                         [](const testing::TestParamInfo<Case>& tested) { return tested.param.name; });

TEST_P(Graded, HasShortEdgesWhereItIsTouched) {
  const GradedMesh graded = mesh();
  const Mesh& local = graded.mesh.local;
  const Vec3 touch = body_.flat_position(centre());
  double shortest = 1e9;
  for (Index e = 0; e < local.elements(); ++e) {
    const auto nodes = local.element_nodes(e);
    for (const EdgeNodes& edge : element_edges(body_.model().mesh.element)) {
      const Vec3 &a = local.nodes[nodes[edge[0]]], &b = local.nodes[nodes[edge[1]]];
      const double room = GetParam().is_round ? 1.1 : 1.0 + 1e-12;  // distances are those of the flat mesh
      EXPECT_LE((a - b).norm(), room * std::max(finest, (0.5 * (a + b) - touch).norm()));
      shortest = std::min(shortest, (a - b).norm());
    }
    EXPECT_GT(smallest_determinant(local.element, element_nodes(local, e)), 0.0);
  }
  EXPECT_LE(shortest, finest);
}

TEST_P(Graded, FillsWhatItsElementsFill) {
  const GradedMesh graded = mesh();
  const Mesh& whole = body_.model().mesh;
  double fine = 0.0, coarse = 0.0;
  for (Index e = 0; e < graded.mesh.local.elements(); ++e)
    fine += element_volume(graded.mesh.local.element, element_nodes(graded.mesh.local, e));
  for (const Index e : graded.mesh.elements) coarse += element_volume(whole.element, element_nodes(whole, e));
  if (GetParam().is_round) {
    EXPECT_GT(fine, 1.002 * coarse);  // a round side takes more room than its chords
    EXPECT_LT(fine, 1.3 * coarse);
  } else {
    EXPECT_NEAR(fine, coarse, 1e-12 * coarse);
  }
}

// The fine mesh's facets are the rounded surface, so that its shape functions put a surface node where it is.
TEST_P(Graded, CarriesTheSurfaceNodes) {
  const GradedMesh graded = mesh();
  const auto patch = make_patch(body_, graded, condense(body_.model(), graded.mesh));
  const std::vector<Index> fine = surface_nodes(graded.mesh);
  ASSERT_EQ(d_ * std::ssize(fine), patch->fine_dofs());
  std::size_t several = 0;
  for (std::size_t k = 0; k < patch->surface_nodes().size(); ++k) {
    Vec3 position = Vec3::Zero();
    double sum = 0.0;
    std::size_t parts = 0;
    patch->for_each_part(static_cast<Index>(k), [&](Index node, double weight) {
      position += weight * graded.mesh.local.nodes[fine[static_cast<std::size_t>(node)]];
      sum += weight;
      ++parts;
    });
    several += parts > 1 ? 1 : 0;
    EXPECT_NEAR(sum, 1.0, 1e-12);
    const Vec3& rest = body_.surface_rest_positions()[static_cast<std::size_t>(patch->surface_nodes()[k])];
    EXPECT_LT((position - rest).norm(), 1e-12);
  }
  EXPECT_GT(several, 0U);
}

// All surface nodes in turn, in the patch and beside it, with the patch and without.
TEST_P(Graded, IsTheRefinedBodyExactly) {
  const GradedMesh graded = mesh();
  const auto patch = make_patch(body_, graded, condense(body_.model(), graded.mesh));
  const MatrixXd whole = reference(graded.mesh, *patch);
  const double tolerance = 1e-10 * whole.norm();
  std::vector<Index> moving;
  for (Index node = 0; node < std::ssize(body_.surface_rest_positions()); ++node) {
    if (body_.surface_moves(node)) moving.push_back(node);
  }
  NearField near(body_, 24, static_cast<Index>(patch->stored_nodes().size()));
  std::mt19937 random(5);
  for (int round = 0; round < 6; ++round) {
    near.begin_tick();
    if (round % 3 == 0) {
      ASSERT_TRUE(near.change_patch(body_, nullptr));
    }
    for (int k = 0; k < 6; ++k) {
      near.want(body_, moving[random() % moving.size()]);
      Index in_patch = -1;
      while (in_patch < 0 || !body_.surface_moves(in_patch))
        in_patch = patch->surface_nodes()[random() % patch->surface_nodes().size()];
      near.want(body_, in_patch);
    }
    if (round % 3 == 0) {
      ASSERT_TRUE(near.change_patch(body_, patch));
    }
    for (Index i = 0; i < d_ * near.count(); ++i) {
      for (Index j = 0; j < d_ * near.count(); ++j) {
        ASSERT_NEAR(near.row(i)[static_cast<std::size_t>(j)],
                    whole(d_ * near.node(i / d_) + i % d_, d_ * near.node(j / d_) + j % d_), tolerance);
      }
    }
    Eigen::VectorXd f = Eigen::VectorXd::Zero(whole.cols());
    near.unload();
    for (Index place = round % 2; place < near.count(); place += 2) {
      Vec3 force = Vec3::Zero();
      for (int axis = 0; axis < d_; ++axis) force[axis] = static_cast<double>(random() % 100) - 50.0;
      near.load(place, force);
      f.segment(d_ * near.node(place), d_) = force.head(d_);
    }
    near.displace();
    const Eigen::VectorXd u = whole * f;
    std::vector<double> stored(static_cast<std::size_t>(body_.greens().order()));
    std::vector<Vec3> surface(body_.surface_rest_positions().size());
    surface_displacement(body_, near.load(), stored, surface);
    for (std::size_t node = 0; node < surface.size(); ++node) {
      ASSERT_LT((surface[node].head(d_) - u.segment(d_ * static_cast<Index>(node), d_)).norm(),
                1e-10 * u.norm());
    }
    const Eigen::Map<const Eigen::VectorXd> of_body(stored.data(), std::ssize(stored));
    EXPECT_LT((of_body - u.tail(of_body.size())).norm(), 1e-10 * u.norm());
  }
}

TEST_P(Graded, IsMadeRoundAnySurfaceNode) {
  PatchMaker maker(body_, 1, finest);
  ASSERT_TRUE(maker.is_graded());
  const Index room = patch_room(body_, 1, 1);
  for (Index node = 0; node < body_.fine_surface().nodes(); node += 29) {
    if (!body_.surface_moves(node)) continue;
    const auto patch = maker.make({&node, 1});
    EXPECT_LE(std::ssize(patch->stored_nodes()), room);
    EXPECT_TRUE(std::binary_search(patch->surface_nodes().begin(), patch->surface_nodes().end(), node));
    EXPECT_EQ(centre_of_record(body_, recorded_centre(body_, node)), node);
  }
  EXPECT_EQ(centre_of_record(body_, body_.fine_surface().nodes()), -1);
  EXPECT_EQ(centre_of_record(body_, -1), -1);
}

}  // namespace
}  // namespace palpate::graded_patch_test
