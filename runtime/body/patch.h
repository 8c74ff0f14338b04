// An overlay as the tick uses it.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "overlay/condensation.h"
#include "overlay/patch_mesh.h"
#include "runtime/body/body.h"

namespace palpate {

/// Where a patch is under no forces by the tangent of a law that is not linear (docs/overlays.md): what
/// comes on top of the linear answer.
struct PatchOffset {
  Eigen::VectorXd forces;  ///< [d g] that act on Q all the time [N]
  Eigen::VectorXd
      surface;  ///< [d m] displacement of the surface, in the order of CondensedPatch::surface [m]
};

/// A patch of the body's surface with a finer mesh under it, condensed (theory.md section 4): whatever the
/// refinement, what a tick needs is here. d dofs a node; Q are the g nodes of the body in the patch. Const
/// once made; any number of threads may use it.
class Patch {
 public:
  /// A patch of a body whose surface is refined as the patch's mesh. Throws Error when a node of Q is not
  /// stored, as the file keeps too few layers below the surface.
  Patch(const Body& body, const PatchMesh& mesh, const CondensedPatch& condensed);
  /// One by a tangent about a deformed place: `offset` is what is there without forces.
  Patch(const Body& body, const PatchMesh& mesh, const CondensedPatch& condensed, const PatchOffset& offset);

  /// [m] surface nodes of the body (Body::simplices), ascending.
  [[nodiscard]] std::span<const Index> surface_nodes() const noexcept { return surface_nodes_; }
  /// Elements of the body that it refines, ascending.
  [[nodiscard]] std::span<const Index> elements() const noexcept { return elements_; }
  /// [g] stored nodes Q.
  [[nodiscard]] std::span<const Index> stored_nodes() const noexcept { return stored_nodes_; }

  /// Row [d m] of the compliance between surface nodes, T Xi_G,QQ T^T + K_L^-1 [m/N]: of dof d k + axis for
  /// the k-th of them.
  [[nodiscard]] const double* compliance(Index dof) const noexcept { return compliance_.row(dof).data(); }
  /// Row [d g] of H = T (I + Xi_QQ M): displacement of a surface dof by what forces beside the patch do to Q
  /// without the overlay. Forces f on the surface nodes do to the rest of the body what H^T f on Q does
  /// without the overlay.
  [[nodiscard]] const double* response(Index dof) const noexcept { return response_.row(dof).data(); }
  /// Row [d g] of M [N/m]: forces on Q that, beside forces elsewhere, stand for the overlay (Overlay).
  [[nodiscard]] const double* correction(Index dof) const noexcept { return correction_.row(dof).data(); }

  /// Whether it is moved without forces, as patches by a tangent are; else the next two are empty.
  [[nodiscard]] bool has_offset() const noexcept { return offset_.size() > 0; }
  /// [d m] displacement of the surface's dofs under no forces [m].
  [[nodiscard]] const Eigen::VectorXd& offset() const noexcept { return offset_; }
  /// [d g] forces on Q that, without the overlay, move the rest of the body as it is under no forces [N].
  [[nodiscard]] const Eigen::VectorXd& offset_forces() const noexcept { return offset_forces_; }

  /// Memory that it takes.
  [[nodiscard]] std::size_t bytes() const noexcept;
  /// Memory that one of this takes.
  [[nodiscard]] static std::size_t bytes_of(const CondensedPatch& condensed) noexcept;

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  std::vector<Index> elements_;
  std::vector<Index> surface_nodes_;
  std::vector<Index> stored_nodes_;
  Rows compliance_;
  Rows response_;
  Rows correction_;
  Eigen::VectorXd offset_;
  Eigen::VectorXd offset_forces_;
};

/// The surface node (Body::simplices) that each of some local nodes on the surface is.
std::vector<Index> surface_numbers(const Body& body, const PatchMesh& mesh,
                                   const std::vector<Index>& local_nodes);

/// [g] stored nodes of a patch's nodes. Throws Error when one is not stored: the file keeps too few layers
/// below the surface.
std::vector<Index> stored_nodes_of(const Body& body, const PatchMesh& patch);

/// Xi at the blocks of some stored nodes [d m x d m].
Eigen::MatrixXd greens_at(const Body& body, std::span<const Index> nodes);

/// M = (I - G Xi_QQ)^-1 G, symmetric (theory.md section 4).
Eigen::MatrixXd overlay_correction(const Eigen::MatrixXd& G, const Eigen::MatrixXd& greens);

}  // namespace palpate
