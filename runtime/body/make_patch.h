// Overlay patches of a body, condensed.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "overlay/condensation.h"
#include "overlay/graded_mesh.h"
#include "overlay/patch_mesh.h"
#include "runtime/body/body.h"
#include "runtime/core/body/patch.h"

namespace palpate {

/// Displacement of a patch under no forces by the tangent of a nonlinear law (docs/overlays.md), added to the
/// linear response.
struct PatchOffset {
  Eigen::VectorXd forces;  ///< [d g] forces that always act on Q [N]
  Eigen::VectorXd
      surface;  ///< [d m] displacement of the surface, in the order of CondensedPatch::surface [m]
};

/// A patch of a body whose surface is refined as the patch's mesh; with `offset` one by a tangent about a
/// deformed place. Throws Error when a node of Q is not stored, as the file keeps too few layers below the
/// surface.
std::shared_ptr<const Patch> make_patch(const Body& body, const PatchMesh& mesh,
                                        const CondensedPatch& condensed, const PatchOffset& offset = {});

/// Makes a patch of a rounded body from a graded mesh, whose shape functions its surface nodes follow.
std::shared_ptr<const Patch> make_patch(const Body& body, const GradedMesh& mesh,
                                        const CondensedPatch& condensed);

/// Memory that a patch of this takes, at most [bytes].
std::size_t bytes_of(const CondensedPatch& condensed) noexcept;

/// Returns the surface nodes (Body::simplices) of local nodes on the surface.
std::vector<Index> surface_numbers(const Body& body, const PatchMesh& mesh,
                                   const std::vector<Index>& local_nodes);

/// Returns the [g] stored nodes of a patch's nodes. Throws Error if one is not stored because the file has
/// too few layers below the surface.
std::vector<Index> stored_nodes_of(const Body& body, const PatchMesh& patch);

/// Returns Xi between some stored nodes [d m x d m].
Eigen::MatrixXd greens_at(const Body& body, std::span<const Index> nodes);

/// Returns M = (I - G Xi_QQ)^-1 G, symmetric (theory.md section 4).
Eigen::MatrixXd overlay_correction(const Eigen::MatrixXd& G, const Eigen::MatrixXd& greens);

}  // namespace palpate
