// Layers of the free dofs of a patch's fine mesh, and their elimination.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "formats/condensed_patch.h"
#include "overlay/patch_mesh.h"

namespace palpate {

/// Free local nodes by their distance from the surface, in elements: nodes of a layer share elements with the
/// adjacent layers only.
class PatchLayers {
 public:
  /// `surface`: local nodes on the body's surface.
  PatchLayers(const PatchMesh& patch, int dimension, const std::vector<Index>& surface);

  [[nodiscard]] int count() const { return static_cast<int>(sizes_.size()); }
  [[nodiscard]] Eigen::Index size(int layer) const { return sizes_[layer]; }  ///< dofs of a layer
  /// Layer of a local node, negative if it has none.
  [[nodiscard]] int layer_of(Index node) const { return layer_of_[static_cast<std::size_t>(node)]; }
  /// Place of a local dof in its layer, -1 if it is not free.
  [[nodiscard]] Index place_of(std::size_t dof) const { return first_dof_[dof]; }

 private:
  static constexpr int none = -1, unreached = -2;

  void add_layer(const std::vector<Index>& nodes, const PatchMesh& patch, std::size_t d);
  [[nodiscard]] std::vector<Index> next_to(const PatchMesh& patch) const;

  std::vector<int> layer_of_;
  std::vector<Index> first_dof_;
  std::vector<Eigen::Index> sizes_;
};

/// K_L, which is block tridiagonal, and columns beside it, K_LG first. Its memory serves for patch after
/// patch.
struct LayeredStiffness {
  std::vector<Eigen::Map<Eigen::MatrixXd>> diagonal;  ///< [n_k x n_k] lower triangle
  std::vector<Eigen::Map<Eigen::MatrixXd>> above;     ///< [n_k x n_(k-1)] to the layer before
  std::vector<Eigen::Map<Eigen::MatrixXd>> columns;   ///< [n_k x columns]

  /// Sets all to zero, with that many columns.
  void clear(const PatchLayers& layers, Eigen::Index width);

 private:
  std::vector<double> entries_;
};

/// Eliminates layer by layer, from the deepest to the surface, and adds C^T K_L^-1 C of the columns C to the
/// lower triangle of `G`. Leaves factors L_k on the diagonal, and L_k^-1 multiplied into the rest. Returns
/// false if K_L is not positive definite.
[[nodiscard]] bool eliminate(LayeredStiffness& K, Eigen::MatrixXd& G);

/// Result at the surface's layer, after `eliminate`.
struct SurfaceLayer {
  Eigen::MatrixXd compliance;  ///< K_L^-1
  Eigen::MatrixXd columns;     ///< K_L^-1 C
};
[[nodiscard]] SurfaceLayer surface_layer(const LayeredStiffness& K);

/// Fills T and the compliance of the patch's surface; `result` already has the surface's nodes.
void put_surface(const PatchLayers& layers, const SurfaceLayer& surface,
                 const Eigen::SparseMatrix<double, Eigen::RowMajor>& shape, Eigen::Index dimension,
                 CondensedPatch& result);

}  // namespace palpate
