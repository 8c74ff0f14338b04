// Overlay in the form that the tick uses.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "overlay/condensation.h"
#include "overlay/patch_mesh.h"
#include "runtime/body/body.h"

namespace palpate {

/// Displacement of a patch under no forces, for the tangent of a nonlinear law (docs/overlays.md), in
/// addition to the linear response.
struct PatchOffset {
  Eigen::VectorXd forces;  ///< [d g] forces that always act on Q [N]
  Eigen::VectorXd
      surface;  ///< [d m] displacement of the surface, in the order of CondensedPatch::surface [m]
};

/// Patch of the body's surface with a finer mesh below it, condensed (theory.md section 4) to the data of the
/// tick, whose size below the surface does not depend on the refinement. d dofs per node; Q are the g nodes
/// of the body in the patch. Constant once made; any number of threads may use it.
class Patch {
 public:
  /// Patch of a body whose surface is refined like the patch's mesh. Throws Error if a node of Q is not
  /// stored because the file has too few layers below the surface.
  Patch(const Body& body, const PatchMesh& mesh, const CondensedPatch& condensed);
  /// Patch from a tangent about a deformed state: `offset` is the displacement without forces.
  Patch(const Body& body, const PatchMesh& mesh, const CondensedPatch& condensed, const PatchOffset& offset);

  /// [m] surface nodes (Body::simplices), ascending.
  [[nodiscard]] std::span<const Index> surface_nodes() const noexcept { return surface_nodes_; }
  /// Refined elements of the body, ascending.
  [[nodiscard]] std::span<const Index> elements() const noexcept { return elements_; }
  /// [g] stored nodes Q.
  [[nodiscard]] std::span<const Index> stored_nodes() const noexcept { return stored_nodes_; }

  /// Row [d m] of the compliance between surface nodes, T Xi_G,QQ T^T + K_L^-1 [m/N], of dof d k + axis for
  /// the k-th node.
  [[nodiscard]] const double* compliance(Index dof) const noexcept { return compliance_.row(dof).data(); }
  /// Row [d g] of H = T (I + Xi_QQ M): displacement of a surface dof by the displacement of Q that forces
  /// outside the patch cause without the overlay. Conversely, forces f on the surface nodes act on the rest
  /// of the body as H^T f on Q without the overlay.
  [[nodiscard]] const double* response(Index dof) const noexcept { return response_.row(dof).data(); }
  /// Row [d g] of M [N/m]: forces on Q that represent the overlay, beside forces elsewhere (Overlay).
  [[nodiscard]] const double* correction(Index dof) const noexcept { return correction_.row(dof).data(); }

  /// True if it is displaced without forces, as patches from a tangent are; otherwise the next two are empty.
  [[nodiscard]] bool has_offset() const noexcept { return offset_.size() > 0; }
  /// [d m] displacement of the surface's dofs under no forces [m].
  [[nodiscard]] const Eigen::VectorXd& offset() const noexcept { return offset_; }
  /// [d g] forces on Q that, without the overlay, cause the displacement of the rest of the body under no
  /// forces [N].
  [[nodiscard]] const Eigen::VectorXd& offset_forces() const noexcept { return offset_forces_; }

  /// Memory use [byte].
  [[nodiscard]] std::size_t bytes() const noexcept;
  /// Memory use of a patch made from `condensed` [byte].
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
