// Coarse body of a mesh, and how the nodes of its Green's functions follow it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

#include "formats/model.h"
#include "runtime/core/body/two_level_greens.h"
#include "runtime/depth/coarse_body.h"

namespace palpate {

/// A coarse body, and how the Green's functions' nodes follow it.
struct CoarseParts {
  std::shared_ptr<const LiveBody> fine;
  std::unique_ptr<const CoarseBody> body;
  std::shared_ptr<const CoarseNodes> nodes;
  Eigen::MatrixXd K;  ///< K_c, tangent at rest [N/m]
};

/// Makes the coarse body of a mesh whose stored nodes are given, with at most `most_dofs` and 0.8 of the
/// mesh's dofs.
CoarseParts make_coarse_parts(std::shared_ptr<const LiveBody> fine, std::span<const Index> stored_nodes,
                              Index most_dofs);

/// Makes the coarse body of a model: neo-Hookean, or corotational where a material has initial strain.
CoarseParts make_coarse_parts(const Model& model);

/// The coarse field at a stored node: displacement [m], gradient of the position, and its rotation.
struct CoarseAt {
  Vec3 moved = Vec3::Zero();
  Mat3 F = Mat3::Identity(), R = Mat3::Identity();
};

[[nodiscard]] CoarseAt coarse_at(const CoarseNodes& nodes, Index node, std::span<const double> q) noexcept;

}  // namespace palpate
