// A body whose compressed Green's functions tests hold against the dense inverse of K.
#pragma once

#include <cblas.h>

#include <cstdint>
#include <utility>

#include "meshes/surface.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/scope.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/compression/clustered_body.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::test {

/// A factorised body with its stored nodes in clusters, and Xi of them by the dense inverse of K.
class InvertedBody {
 public:
  explicit InvertedBody(ElasticCase of, const ClusterOptions& options = {.leaf = 12},
                        Scope scope = Scope::surface)
      : elastic_(std::move(of)),
        stiffness_(assemble_stiffness(elastic_.body())),
        factor_(stiffness_.K, stiffness_.node_start),
        stored_(elastic_.mesh, stiffness_,
                stored_dof_marks(elastic_.mesh, extract_surface(elastic_.mesh), stiffness_, scope, 0),
                options) {
    openblas_set_num_threads(1);  // as a bake does
    factor_.factorize();
    const Eigen::MatrixXd K = Eigen::MatrixXd(stiffness_.K).selfadjointView<Eigen::Lower>();
    const Eigen::MatrixXd inverse = inverse_of(K);
    const auto n = std::ssize(stored_.dofs);
    Xi_ = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        const std::int64_t row = dof(i), column = dof(j);
        if (row >= 0 && column >= 0) Xi_(i, j) = inverse(row, column);
      }
    }
  }

  [[nodiscard]] int dimension() const { return elastic_.mesh.dimension(); }
  [[nodiscard]] const Factor& factor() const { return factor_; }
  [[nodiscard]] const ClusteredBody& stored() const { return stored_; }
  [[nodiscard]] const Eigen::MatrixXd& Xi() const { return Xi_; }  ///< [d N, d N], 0 where held [m/N]

 private:
  [[nodiscard]] std::int64_t dof(Eigen::Index i) const { return stored_.dofs[static_cast<std::size_t>(i)]; }

  ElasticCase elastic_;
  Stiffness stiffness_;
  Factor factor_;
  ClusteredBody stored_;
  Eigen::MatrixXd Xi_;
};

}  // namespace palpate::test
