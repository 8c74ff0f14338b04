// Fine mesh of an overlay: some elements of the body, each cut into smaller ones.
#pragma once

#include <Eigen/SparseCore>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "formats/model.h"
#include "overlay/nested_nodes.h"

namespace palpate {

/// Elements at each node of a mesh.
class ElementsAtNodes {
 public:
  explicit ElementsAtNodes(const Mesh& mesh);
  [[nodiscard]] std::span<const Index> operator[](Index node) const noexcept {
    const auto at = static_cast<std::size_t>(node);
    return {elements_.data() + start_[at], static_cast<std::size_t>(start_[at + 1] - start_[at])};
  }

 private:
  std::vector<Index> start_;     // [N + 1]
  std::vector<Index> elements_;  // ascending at each node
};

/// Elements around some mesh nodes, ascending: those at the nodes, and for each further ring those at the
/// nodes of the ring before.
std::vector<Index> rings_round(const Mesh& mesh, const ElementsAtNodes& at, std::span<const Index> nodes,
                               int rings);

/// Nodes of some elements, without duplicates, ascending.
std::vector<Index> nodes_of(const Mesh& mesh, std::span<const Index> elements);

/// Throws Error (where = `where`) for a body of tet4a, whose stiffness is no sum over elements that an
/// overlay could replace.
void check_for_overlays(const Model& model, const std::string& where);

/// A side of a patch element that no other patch element has.
struct OuterSide {
  std::size_t number;  ///< among the element's sides
  unsigned corners;    ///< bit k: the element's corner k is on it
  bool is_border;      ///< the body goes on behind it; else it is the body's surface
};

/// Outer sides of an element of a patch of elements, which are ascending.
std::vector<OuterSide> outer_sides(const Mesh& mesh, const ElementsAtNodes& at, std::span<const Index> patch,
                                   Index element);

/// A patch of elements and the mesh nested in it.
struct PatchMesh {
  std::vector<Index> elements;  ///< elements of the body, ascending
  std::vector<Index>
      nodes;   ///< [g] mesh nodes of those elements that are not held along every axis, ascending
  Mesh local;  ///< the fine mesh
  std::vector<Index> body_node;         ///< [local nodes] coincident node of the body, -1 if there is none
  std::vector<Vec3> rest_displacement;  ///< [local nodes] u0 there, by the body's shape functions [m]
  std::vector<Index> parent;            ///< [local elements] element of the body that contains it
  std::vector<Index> surface;  ///< [simplices * d] local nodes on the body's surface, as Model::surface
  /// [local nodes x g] the body's shape functions of `nodes` at the local nodes: there u_G is `shape` u_G.
  Eigen::SparseMatrix<double, Eigen::RowMajor> shape;
  /// [d * local nodes] number of each local dof among the free ones, -1 if u_L = 0: on the border Γ^GL to the
  /// rest of the body, at nodes that coincide with the body's, and where the body is held (theory.md section
  /// 4).
  std::vector<Index> free_dof;
  Index free_dofs = 0;
  std::map<NodeKey, Index> node_of_key;  ///< keys of all local nodes
};

/// [m] local nodes on the body's surface, ascending.
std::vector<Index> surface_nodes(const PatchMesh& patch);

/// The body's shape functions by dofs, without the dofs along which its nodes are held: maps u_G of the
/// patch's nodes [d g] to all local dofs [d local nodes]. [d local nodes x d g]
Eigen::SparseMatrix<double, Eigen::RowMajor> shape_by_dofs(const Model& model, const PatchMesh& patch);

/// Stiffness [d g x d g] of the body's own elements in the patch [N/m]; zero for dofs that are held.
Eigen::MatrixXd patch_stiffness(const Model& model, const PatchMesh& patch);

/// Cuts each of the elements into r^d. Throws Error unless r >= 2, if an element is not one of the model's,
/// or if there is none. `cuts` keeps subdivisions from patch to patch.
PatchMesh make_patch_mesh(const Model& model, const ElementsAtNodes& at, Subdivisions& cuts,
                          std::vector<Index> elements);
PatchMesh make_patch_mesh(const Model& model, const ElementsAtNodes& at, std::vector<Index> elements, int r);

}  // namespace palpate
