// Patches as the tick uses them, against the body and its fine mesh solved as one dense system.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "meshes/element.h"
#include "runtime/body/make_patch.h"
#include "runtime/body/overlay.h"
#include "runtime/core/body/free_motion.h"
#include "runtime/core/body/near_field.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::patch_test {
namespace {

using Eigen::MatrixXd;

struct Case {
  ElementType element;
  int cells;
  int refinement;
  int rings;
};

/// A body, a patch round the middle of its top, and the dense inverse of both together.
class Patches : public testing::TestWithParam<Case> {
 protected:
  Body body_{test::unit_model(GetParam().element, GetParam().cells, Scope::full, Precision::double_precision),
             {},
             GetParam().refinement};
  ElementsAtNodes at_{body_.model().mesh};
  int d_ = body_.dimension();

  [[nodiscard]] PatchMesh mesh() const {
    const Vec3 top = test::top_middle(d_);
    const Index node = body_.mesh_node(body_.nearest_surface_node(top).node);
    return make_patch_mesh(body_.model(), at_,
                           rings_round(body_.model().mesh, at_, {&node, 1}, GetParam().rings),
                           GetParam().refinement);
  }

  /// Displacement of fine surface nodes and of all stored nodes by forces on them [m/N].
  [[nodiscard]] MatrixXd reference(const PatchMesh& patch, std::span<const Index> surface_nodes,
                                   bool overlay = true) const {
    PatchStiffness local = assemble_patch(body_.model(), patch);
    if (!overlay) {
      local.K_L.setIdentity();
      local.K_LG.setZero();
    }
    const MatrixXd Xi = whole_greens();
    const Eigen::Index n = Xi.rows();
    const Eigen::Index l = local.K_L.rows();
    MatrixXd K = MatrixXd::Zero(n + l, n + l);
    K.topLeftCorner(n, n) = Xi.inverse();
    K.bottomRightCorner(l, l) = local.K_L;
    for (std::size_t k = 0; k < patch.nodes.size(); ++k) {
      const Eigen::Index stored = body_.stored_node(patch.nodes[k]);
      K.block(n, d_ * stored, l, d_) = local.K_LG.middleCols(d_ * static_cast<Eigen::Index>(k), d_);
    }
    K.topRightCorner(n, l) = K.bottomLeftCorner(l, n).transpose();

    const auto m = static_cast<Eigen::Index>(surface_nodes.size());
    MatrixXd E = MatrixXd::Zero(d_ * m + n, n + l);  // displacement of what is asked for by all dofs
    for (Eigen::Index k = 0; k < m; ++k) {
      const Index node = surface_nodes[static_cast<std::size_t>(k)];
      const SurfaceParts parts = body_.surface_parts(node);
      for (int axis = 0; axis < d_; ++axis) {
        for (std::size_t p = 0; p < parts.stored.size(); ++p)
          E(d_ * k + axis, d_ * parts.stored[p] + axis) = parts.weights[p];
        const Index place = overlay ? local_node(patch, node) : -1;
        const Index free = place < 0 ? -1 : patch.free_dof[static_cast<std::size_t>(d_ * place + axis)];
        if (free >= 0) E(d_ * k + axis, n + free) = 1.0;
      }
    }
    E.bottomLeftCorner(n, n).setIdentity();
    return E * K.ldlt().solve(E.transpose());
  }

 private:
  [[nodiscard]] MatrixXd whole_greens() const {
    std::vector<Index> all(static_cast<std::size_t>(body_.greens().nodes()));
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<Index>(k);
    return greens_at(body_, all);
  }

  /// By its place, where Patch goes by the corners and weights; -1 beside the patch.
  [[nodiscard]] Index local_node(const PatchMesh& patch, Index surface_node) const {
    const Vec3& x = body_.surface_rest_positions()[static_cast<std::size_t>(surface_node)];
    for (std::size_t k = 0; k < patch.local.nodes.size(); ++k) {
      if ((patch.local.nodes[k] - x).norm() < 1e-9) return static_cast<Index>(k);
    }
    return -1;
  }
};

INSTANTIATE_TEST_SUITE_P(Elements, Patches,
                         testing::Values(Case{ElementType::tri3, 4, 3, 1}, Case{ElementType::tri3, 4, 2, 2},
                                         Case{ElementType::quad4, 4, 3, 1}, Case{ElementType::tet4, 4, 2, 1},
                                         Case{ElementType::tet4, 4, 3, 1}, Case{ElementType::tet4, 3, 3, 2},
                                         Case{ElementType::tet10, 2, 2, 1}, Case{ElementType::hex8, 4, 3, 1},
                                         Case{ElementType::tet4, 2, 2,
                                              4}),  // the whole body, with nodes that are held
                         [](const testing::TestParamInfo<Case>& tested) {
                           return std::string(traits(tested.param.element).name) + "Cells" +
                                  std::to_string(tested.param.cells) + "Refinement" +
                                  std::to_string(tested.param.refinement) + "Rings" +
                                  std::to_string(tested.param.rings);
                         });

TEST_P(Patches, AreTheFineMeshExactly) {
  const PatchMesh patch_mesh = mesh();
  const std::shared_ptr<const Patch> made =
      make_patch(body_, patch_mesh, condense(body_.model(), patch_mesh));
  const Patch& patch = *made;
  const auto m = static_cast<Eigen::Index>(patch.surface_nodes().size());
  ASSERT_GT(m, std::ssize(patch.stored_nodes()) / 4);
  ASSERT_TRUE(std::is_sorted(patch.surface_nodes().begin(), patch.surface_nodes().end()));
  const MatrixXd reference = this->reference(patch_mesh, patch.surface_nodes());
  const double scale = reference.norm();

  const Eigen::Index n = reference.rows() - d_ * m;
  const Eigen::Index g = d_ * std::ssize(patch.stored_nodes());
  MatrixXd Xi_Q(g, n);  // by forces on stored nodes, without the overlay
  std::vector<Index> all(static_cast<std::size_t>(body_.greens().nodes()));
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<Index>(k);
  for (Eigen::Index k = 0; k < g / d_; ++k) {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(d_, n);
    body_.greens().gather(patch.stored_nodes()[static_cast<std::size_t>(k)], all,
                          {rows.data(), static_cast<std::size_t>(rows.size())});
    Xi_Q.middleRows(d_ * k, d_) = rows;
  }
  const auto rows_of = [](Eigen::Index count, Eigen::Index width, auto&& row) {
    MatrixXd matrix(count, width);
    for (Eigen::Index i = 0; i < count; ++i)
      matrix.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row(static_cast<Index>(i)), width);
    return matrix;
  };
  const MatrixXd C = rows_of(d_ * m, d_ * m, [&](Index i) { return patch.compliance(i); });
  const MatrixXd H = rows_of(d_ * m, g, [&](Index i) { return patch.response(i); });
  const MatrixXd M = rows_of(g, g, [&](Index i) { return patch.correction(i); });
  EXPECT_LT((C - reference.topLeftCorner(d_ * m, d_ * m)).norm(), 1e-11 * scale);
  EXPECT_LT((H * Xi_Q - reference.topRightCorner(d_ * m, n)).norm(), 1e-11 * scale);
  const MatrixXd change = Xi_Q.transpose() * M * Xi_Q;
  std::vector<Index> stored(all);
  const MatrixXd Xi = greens_at(body_, stored);
  EXPECT_LT((Xi + change - reference.bottomRightCorner(n, n)).norm(), 1e-11 * scale);
  EXPECT_GT(change.norm(), 1e-4 * scale);
}

/// The compliance that a near field has, in the order of its places, is that of the reference.
void expect_compliance(const NearField& near, const MatrixXd& reference) {
  const Index d = near.dimension();
  const double tolerance = 1e-11 * reference.norm();
  for (Index i = 0; i < d * near.count(); ++i) {
    for (Index j = 0; j < d * near.count(); ++j) {
      const double expected = reference(d * near.node(i / d) + i % d, d * near.node(j / d) + j % d);
      ASSERT_NEAR(near.row(i)[static_cast<std::size_t>(j)], expected, tolerance)
          << "places " << i / d << " and " << j / d;
    }
  }
}

// All surface nodes in turn, in the patch and beside it, with patches that come and go.
TEST_P(Patches, AreWhatTheNearFieldHas) {
  const PatchMesh patch_mesh = mesh();
  const auto patch = make_patch(body_, patch_mesh, condense(body_.model(), patch_mesh));
  std::vector<Index> all(body_.surface_rest_positions().size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<Index>(k);
  const MatrixXd with = reference(patch_mesh, all);
  const MatrixXd without = reference(patch_mesh, all, false);

  constexpr Index room = 24;
  NearField near(body_, room, static_cast<Index>(patch->stored_nodes().size()));
  std::mt19937 random(3);
  std::vector<Index> moving;
  std::copy_if(all.begin(), all.end(), std::back_inserter(moving),
               [&](Index node) { return body_.surface_moves(node); });
  const auto any = [&] { return moving[random() % moving.size()]; };
  const auto any_in_patch = [&] {
    Index node = -1;
    while (node < 0 || !body_.surface_moves(node))
      node = patch->surface_nodes()[random() % patch->surface_nodes().size()];
    return node;
  };
  for (int tick = 0; tick < 30; ++tick) {
    near.begin_tick();
    for (int k = 0; k < 3; ++k) {
      near.want(body_, any());
      near.want(body_, any_in_patch());
    }
    if (tick % 5 == 4) {
      const Index before = near.count();
      ASSERT_TRUE(near.change_patch(body_, tick % 10 == 4 ? patch : nullptr));
      EXPECT_LE(near.count(), 6);
      EXPECT_LT(near.count(), before);
      for (int k = 0; k < 8; ++k) near.want(body_, any());
    }
    expect_compliance(near, near.patch() != nullptr ? with : without);
    if (HasFatalFailure()) return;

    Eigen::VectorXd f = Eigen::VectorXd::Zero(with.cols());
    near.unload();
    // Even and odd places in turn: where one is full, a node that comes moves a node that is loaded next.
    for (Index place = tick % 2; place < near.count(); place += 2) {
      Vec3 force = Vec3::Zero();
      for (int axis = 0; axis < d_; ++axis) force[axis] = static_cast<double>(random() % 100) - 50.0;
      near.load(place, force);
      f.segment(d_ * near.node(place), d_) = force.head(d_);
    }
    near.displace();
    const Eigen::VectorXd u = (near.patch() != nullptr ? with : without) * f;
    for (Index place = 0; place < near.count(); ++place) {
      EXPECT_LT((near.displacement(place).head(d_) - u.segment(d_ * near.node(place), d_)).norm(),
                1e-11 * u.norm());
    }
    std::vector<double> stored(static_cast<std::size_t>(body_.greens().order()));
    std::vector<Vec3> surface(all.size());
    surface_displacement(body_, near.load(), stored, surface);
    for (std::size_t node = 0; node < all.size(); ++node) {
      ASSERT_LT((surface[node].head(d_) - u.segment(d_ * static_cast<Index>(node), d_)).norm(),
                1e-11 * u.norm())
          << "surface node " << node << (near.patch() != nullptr ? " with" : " without") << " patch";
    }
    const Eigen::Map<const Eigen::VectorXd> of_body(stored.data(), std::ssize(stored));
    EXPECT_LT((of_body - u.tail(of_body.size())).norm(), 1e-11 * u.norm());
  }
}

TEST_P(Patches, CondenseAsTheOverlayDoes) {
  const PatchMesh patch_mesh = mesh();
  const CondensedPatch condensed = condense(body_.model(), patch_mesh);
  const PatchStiffness local = assemble_patch(body_.model(), patch_mesh);
  const MatrixXd G = local.K_LG.transpose() * MatrixXd(local.K_L).ldlt().solve(local.K_LG);
  EXPECT_LT((condensed.G - G).norm(), 1e-12 * G.norm());
}

}  // namespace
}  // namespace palpate::patch_test
