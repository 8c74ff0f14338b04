#include "overlay/patch_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "base/error.h"
#include "meshes/element.h"
#include "meshes/subdivision.h"
#include "meshes/surface.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

constexpr double no_part = 1e-12;  // value of a shape function that counts as zero

/// Builds a patch's mesh element by element.
class Builder {
 public:
  Builder(const Model& model, const ElementsAtNodes& at, Subdivisions& cuts, std::vector<Index> elements)
      : model_(model), at_(at), cuts_(cuts), d_(model.dimension()) {
    patch_.elements = std::move(elements);
    patch_.local.element = model.mesh.element;
    surface_.facet = traits(model.mesh.element).facet;
    choose_nodes();
  }

  PatchMesh build() {
    for (const Index e : patch_.elements) cut(e);
    patch_.local.regions.assign(patch_.parent.size(), 0);
    patch_.surface = surface_simplices(surface_);
    patch_.shape.resize(static_cast<Eigen::Index>(patch_.local.nodes.size()),
                        static_cast<Eigen::Index>(patch_.nodes.size()));
    patch_.shape.setFromTriplets(shape_.begin(), shape_.end());
    for (const unsigned zero : zero_axes_) {
      for (std::size_t axis = 0; axis < d_; ++axis)
        patch_.free_dof.push_back((zero >> axis & 1U) != 0 ? -1 : patch_.free_dofs++);
    }
    return std::move(patch_);
  }

 private:
  [[nodiscard]] unsigned all_axes() const { return (1U << d_) - 1; }
  [[nodiscard]] unsigned held_axes(Index node) const { return model_.fixed[node] & all_axes(); }

  void choose_nodes() {
    for (const Index e : patch_.elements) {
      for (const Index node : model_.mesh.element_nodes(e)) {
        if (held_axes(node) != all_axes()) place_.emplace(node, 0);
      }
    }
    for (auto& [node, place] : place_) {
      place = static_cast<Index>(patch_.nodes.size());
      patch_.nodes.push_back(node);
    }
  }

  void cut(Index e) {
    const auto nodes = model_.mesh.element_nodes(e);
    const auto corners = nodes.first(traits(model_.mesh.element).corners);
    const Subdivision& parts = cuts_.of(corners);
    const std::vector<OuterSide> sides = outer_sides(model_.mesh, at_, patch_.elements, e);
    std::vector<Index> local;  // numbers of the subdivision's nodes in the local mesh
    for (const Subdivision::Node& node : parts.nodes) {
      const Index number = find_node(node, corners, nodes);
      unsigned bits = 0;  // of the corners with a weight
      for (std::size_t k = 0; k < corners.size(); ++k) bits |= node.weights[k] > 0 ? 1U << k : 0U;
      local.push_back(number);
      for (const OuterSide& side : sides) {
        if (side.is_border && (bits & ~side.corners) == 0) zero_axes_[number] = all_axes();
      }
    }
    const auto add = [&local](const std::vector<Index>& from, std::vector<Index>& to) {
      for (const Index node : from) to.push_back(local[node]);
    };
    add(parts.connectivity, patch_.local.connectivity);
    const auto width = static_cast<std::size_t>(traits(model_.mesh.element).nodes);
    patch_.parent.insert(patch_.parent.end(), parts.connectivity.size() / width, e);
    for (const OuterSide& side : sides) {
      if (!side.is_border) add(parts.sides[side.number], surface_.facets);
    }
  }

  Index find_node(const Subdivision::Node& node, std::span<const Index> corners,
                  std::span<const Index> nodes) {
    const auto [found, is_new] =
        patch_.node_of_key.emplace(key_of(node, corners), static_cast<Index>(patch_.local.nodes.size()));
    const Index number = found->second;
    if (!is_new) return number;
    const ShapeValues N = shape_functions(model_.mesh.element, node.xi);
    Vec3 position = Vec3::Zero();
    Vec3 rest = Vec3::Zero();
    Index coincident = -1;       // node of the body
    unsigned zero = all_axes();  // axes along which all contributing nodes are held
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double part = N[static_cast<Eigen::Index>(k)];
      if (std::abs(part) < no_part) continue;
      if (std::abs(part - 1.0) < no_part) coincident = nodes[k];
      position += part * model_.mesh.nodes[nodes[k]];
      rest += part * model_.rest_displacement[nodes[k]];
      zero &= held_axes(nodes[k]);
      const auto place = place_.find(nodes[k]);
      if (place != place_.end()) shape_.emplace_back(number, place->second, part);
    }
    patch_.local.nodes.push_back(position);
    patch_.rest_displacement.push_back(rest);
    patch_.body_node.push_back(coincident);
    zero_axes_.push_back(coincident >= 0 ? all_axes() : zero);
    return number;
  }

  const Model& model_;
  const ElementsAtNodes& at_;
  Subdivisions& cuts_;
  std::size_t d_;
  PatchMesh patch_;
  Surface surface_;
  std::map<Index, Index> place_;  // of the body's nodes in patch_.nodes
  std::vector<Eigen::Triplet<double>> shape_;
  std::vector<unsigned> zero_axes_;  // [local nodes] bits of the axes along which u_L = 0
};

void sort_unique(std::vector<Index>& numbers) {
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace

ElementsAtNodes::ElementsAtNodes(const Mesh& mesh) : start_(mesh.nodes.size() + 1) {
  for (const Index node : mesh.connectivity) ++start_[static_cast<std::size_t>(node) + 1];
  for (std::size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
  elements_.resize(mesh.connectivity.size());
  std::vector<Index> next(start_.begin(), start_.end() - 1);
  for (Index e = 0; e < mesh.elements(); ++e) {
    for (const Index node : mesh.element_nodes(e)) elements_[next[node]++] = e;
  }
}

std::vector<Index> rings_round(const Mesh& mesh, const ElementsAtNodes& at, std::span<const Index> nodes,
                               int rings) {
  std::vector<Index> reached(nodes.begin(), nodes.end());
  std::vector<Index> elements;
  for (int ring = 0; ring < rings; ++ring) {
    elements.clear();
    for (const Index node : reached) elements.insert(elements.end(), at[node].begin(), at[node].end());
    sort_unique(elements);
    reached = nodes_of(mesh, elements);
  }
  return elements;
}

std::vector<Index> nodes_of(const Mesh& mesh, std::span<const Index> elements) {
  std::vector<Index> nodes;
  for (const Index e : elements)
    nodes.insert(nodes.end(), mesh.element_nodes(e).begin(), mesh.element_nodes(e).end());
  sort_unique(nodes);
  return nodes;
}

std::vector<OuterSide> outer_sides(const Mesh& mesh, const ElementsAtNodes& at, std::span<const Index> patch,
                                   Index element) {
  const ElementTraits& kind = traits(mesh.element);
  const auto nodes = mesh.element_nodes(element);
  std::vector<OuterSide> outer;
  std::size_t number = 0;
  for (const SideNodes& side : element_sides(mesh.element)) {
    std::vector<Index> corners;
    unsigned bits = 0;
    for (int k = 0; k < traits(kind.facet).corners; ++k) {
      corners.push_back(nodes[side[k]]);
      bits |= 1U << side[k];
    }
    const auto neighbour = std::find_if(at[corners[0]].begin(), at[corners[0]].end(), [&](Index e) {
      const auto others = mesh.element_nodes(e);
      return e != element && std::all_of(corners.begin(), corners.end(), [&](Index corner) {
               return std::find(others.begin(), others.end(), corner) != others.end();
             });
    });
    const bool is_surface = neighbour == at[corners[0]].end();
    if (is_surface || !std::binary_search(patch.begin(), patch.end(), *neighbour))
      outer.push_back({number, bits, !is_surface});
    ++number;
  }
  return outer;
}

std::vector<Index> surface_nodes(const PatchMesh& patch) {
  std::vector<Index> nodes = patch.surface;
  sort_unique(nodes);
  return nodes;
}

Eigen::SparseMatrix<double, Eigen::RowMajor> shape_by_dofs(const Model& model, const PatchMesh& patch) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index node = 0; node < patch.shape.outerSize(); ++node) {
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(patch.shape, node); it; ++it) {
      const auto body_node = static_cast<std::size_t>(patch.nodes[it.col()]);
      for (Eigen::Index axis = 0; axis < d; ++axis) {
        if ((model.fixed[body_node] >> axis & 1) == 0)
          entries.emplace_back(d * node + axis, d * it.col() + axis, it.value());
      }
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> result(d * patch.shape.rows(), d * patch.shape.cols());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

Eigen::MatrixXd patch_stiffness(const Model& model, const PatchMesh& patch) {
  const auto d = static_cast<Eigen::Index>(model.dimension());
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(d * std::ssize(patch.nodes), d * std::ssize(patch.nodes));
  for (const Index e : patch.elements) {
    const Material& material =
        model.materials[static_cast<std::size_t>(model.material_of_element[static_cast<std::size_t>(e)])];
    const ElementMatrix K_e = element_stiffness(model.mesh.element, element_nodes(model.mesh, e),
                                                elasticity_matrix(material, model.analysis), model.thickness);
    std::vector<Eigen::Index> place;  // dof of the patch for each of the element, -1 if held
    for (const Index node : model.mesh.element_nodes(e)) {
      const auto found = std::lower_bound(patch.nodes.begin(), patch.nodes.end(), node);
      const bool is_in = found != patch.nodes.end() && *found == node;
      for (Eigen::Index axis = 0; axis < d; ++axis) {
        const bool is_free = is_in && (model.fixed[static_cast<std::size_t>(node)] >> axis & 1) == 0;
        place.push_back(is_free ? d * (found - patch.nodes.begin()) + axis : -1);
      }
    }
    for (std::size_t i = 0; i < place.size(); ++i) {
      for (std::size_t j = 0; j < place.size(); ++j) {
        if (place[i] >= 0 && place[j] >= 0)
          K(place[i], place[j]) += K_e(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      }
    }
  }
  return K;
}

void check_for_overlays(const Model& model, const std::string& where) {
  if (model.mesh.element != ElementType::tet4a) return;
  throw Error("an overlay replaces the stiffness of elements, and that of tet4a is of several together",
              where, "set element = \"tet10\" (or \"tet4\", which locks) in [mesh]");
}

PatchMesh make_patch_mesh(const Model& model, const ElementsAtNodes& at, Subdivisions& cuts,
                          std::vector<Index> elements) {
  std::sort(elements.begin(), elements.end());
  if (cuts.refinement() < 2 || elements.empty()) {
    throw Error("an overlay of " + std::to_string(elements.size()) + " elements, refined " +
                    std::to_string(cuts.refinement()) + " times",
                "make_patch_mesh", "take at least one element and a refinement of at least 2");
  }
  if (elements.front() < 0 || elements.back() >= model.mesh.elements())
    throw Error("an overlay of elements that the body does not have", "make_patch_mesh", "");
  return Builder(model, at, cuts, std::move(elements)).build();
}

PatchMesh make_patch_mesh(const Model& model, const ElementsAtNodes& at, std::vector<Index> elements, int r) {
  Subdivisions cuts(model.mesh.element, r);
  return make_patch_mesh(model, at, cuts, std::move(elements));
}

}  // namespace palpate
