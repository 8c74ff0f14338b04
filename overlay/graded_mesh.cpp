#include "overlay/graded_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <queue>
#include <string>
#include <unordered_map>
#include <utility>

#include "base/error.h"
#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

using Weights = Eigen::Vector4d;  // of the corners of a body's element, as many as it has

constexpr double same_length = 1e-9;  // difference that does not count
constexpr double least_part = 1e-12;  // value of a shape function that counts as zero

/// A simplex in an element of the body.
struct GradedCell {
  std::array<Index, 4> nodes{};
  std::array<Weights, 4> weights;
  Index parent = -1;
};

/// Cells and the edges by which they are bisected.
class Bisection {
 public:
  Bisection(const Mesh& mesh, const PatchFocus& focus)
      : mesh_(mesh),
        focus_(focus),
        corners_(static_cast<std::size_t>(mesh.dimension()) + 1),
        edges_(element_edges(mesh.element)) {}

  void run(std::span<const Index> elements) {
    std::unordered_map<Index, Index> number;
    for (const Index e : elements) {
      GradedCell cell{.weights = {}, .parent = e};
      const auto nodes = mesh_.element_nodes(e);
      for (std::size_t k = 0; k < corners_; ++k) {
        const auto [found, is_new] = number.emplace(nodes[k], static_cast<Index>(positions_.size()));
        if (is_new) positions_.push_back(mesh_.nodes[nodes[k]]);
        cell.nodes[k] = found->second;
        cell.weights[k] = Weights::Unit(static_cast<Eigen::Index>(k));
      }
      add(cell);
    }
    while (!queue_.empty()) {
      const auto [excess, edge] = queue_.top();
      queue_.pop();
      cut(edge);
    }
  }

  /// The cells that have not been cut.
  [[nodiscard]] std::vector<GradedCell> cells() const {
    std::vector<GradedCell> left;
    std::copy_if(cells_.begin(), cells_.end(), std::back_inserter(left),
                 [](const GradedCell& cell) { return cell.parent >= 0; });
    return left;
  }
  /// Number of their corners.
  [[nodiscard]] Index corners() const { return static_cast<Index>(positions_.size()); }

 private:
  using Edge = std::uint64_t;

  static Edge edge_of(Index a, Index b) {
    return static_cast<Edge>(std::min(a, b)) << 32 | static_cast<Edge>(std::max(a, b));
  }

  [[nodiscard]] double excess(Index a, Index b) const {
    const Vec3 middle = 0.5 * (positions_[a] + positions_[b]);
    double wanted = std::numeric_limits<double>::infinity();
    for (const Vec3& point : focus_.points) wanted = std::min(wanted, (middle - point).norm());
    return (positions_[a] - positions_[b]).norm() / std::max(wanted, focus_.edge);
  }

  void add(const GradedCell& cell) {
    const auto number = static_cast<Index>(cells_.size());
    cells_.push_back(cell);
    for (const EdgeNodes& edge : edges_) {
      const Index a = cell.nodes[edge[0]], b = cell.nodes[edge[1]];
      const auto [found, is_new] = round_.try_emplace(edge_of(a, b));
      found->second.push_back(number);
      if (!is_new) continue;
      const double by = excess(a, b);
      if (by > 1.0) queue_.emplace(by, edge_of(a, b));
    }
  }

  [[nodiscard]] double length(Edge edge) const {
    return (positions_[edge >> 32] - positions_[edge & 0xffffffffU]).norm();
  }

  /// The longest edge of the cells round an edge: itself unless another is clearly longer.
  [[nodiscard]] Edge longest_round(Edge edge) const {
    Edge longest = edge;
    for (const Index number : round_.at(edge)) {
      const GradedCell& cell = cells_[number];
      for (const EdgeNodes& other : edges_) {
        const Edge candidate = edge_of(cell.nodes[other[0]], cell.nodes[other[1]]);
        if (length(candidate) > (1.0 + same_length) * length(longest)) longest = candidate;
      }
    }
    return longest;
  }

  /// Bisects an edge once it is the longest of all cells round it; otherwise cells would become ever flatter.
  void cut(Edge edge) {
    while (round_.contains(edge) && !round_.at(edge).empty()) {
      bisect(end_of_path(edge));
    }
  }

  /// Follows longer edges to the end.
  [[nodiscard]] Edge end_of_path(Edge edge) const {
    for (Edge next = longest_round(edge); next != edge; next = longest_round(edge)) edge = next;
    return edge;
  }

  void bisect(Edge edge) {
    const auto a = static_cast<Index>(edge >> 32), b = static_cast<Index>(edge & 0xffffffffU);
    const auto middle = static_cast<Index>(positions_.size());
    positions_.push_back(0.5 * (positions_[a] + positions_[b]));
    const std::vector<Index> round = std::move(round_.at(edge));
    round_.erase(edge);
    for (const Index number : round) {
      const GradedCell cell = cells_[number];
      cells_[number].parent = -1;
      for (const EdgeNodes& other : edges_) {
        const auto found = round_.find(edge_of(cell.nodes[other[0]], cell.nodes[other[1]]));
        if (found != round_.end()) std::erase(found->second, number);
      }
      const auto place = [&](Index node) {
        return static_cast<std::size_t>(std::find(cell.nodes.begin(), cell.nodes.end(), node) -
                                        cell.nodes.begin());
      };
      const Weights between = 0.5 * (cell.weights[place(a)] + cell.weights[place(b)]);
      for (const Index end : {a, b}) {
        GradedCell half = cell;
        half.nodes[place(end)] = middle;
        half.weights[place(end)] = between;
        add(half);
      }
    }
  }

  const Mesh& mesh_;
  const PatchFocus& focus_;
  std::size_t corners_;
  std::span<const EdgeNodes> edges_;
  std::vector<Vec3> positions_;    // in the mesh
  std::vector<GradedCell> cells_;  // `parent` is negative if it has been cut
  std::unordered_map<Edge, std::vector<Index>> round_;
  std::priority_queue<std::pair<double, Edge>> queue_;
};

class GradedBuilder {
 public:
  GradedBuilder(const Model& model, const ElementsAtNodes& at, const Rounding& rounding,
                std::vector<Index> elements)
      : model_(model),
        mesh_(model.mesh),
        at_(at),
        rounding_(rounding),
        d_(static_cast<std::size_t>(model.dimension())) {
    std::sort(elements.begin(), elements.end());
    patch_.elements = std::move(elements);
    patch_.local.element = d_ == 2 ? ElementType::tri6 : ElementType::tet10;
    for (const Index node : nodes_of(mesh_, patch_.elements)) {
      if (held_axes(node) == all_axes()) continue;
      place_.emplace(node, static_cast<Index>(patch_.nodes.size()));
      patch_.nodes.push_back(node);
    }
  }

  GradedMesh build(const PatchFocus& focus) {
    Bisection bisection(mesh_, focus);
    bisection.run(patch_.elements);
    known_.resize(static_cast<std::size_t>(bisection.corners()));
    patch_.local.nodes.resize(known_.size());
    patch_.rest_displacement.resize(known_.size());
    patch_.body_node.resize(known_.size());
    zero_axes_.resize(known_.size());
    offset_.resize(known_.size(), Vec3::Zero());
    for (const GradedCell& cell : bisection.cells()) add(cell);
    patch_.local.regions.assign(patch_.parent.size(), 0);
    round_off();
    patch_.shape.resize(std::ssize(patch_.local.nodes), std::ssize(patch_.nodes));
    patch_.shape.setFromTriplets(shape_.begin(), shape_.end());
    for (const unsigned zero : zero_axes_) {
      for (std::size_t axis = 0; axis < d_; ++axis)
        patch_.free_dof.push_back((zero >> axis & 1U) != 0 ? -1 : patch_.free_dofs++);
    }
    return {std::move(patch_), std::move(facets_)};
  }

 private:
  [[nodiscard]] unsigned all_axes() const { return (1U << d_) - 1; }
  [[nodiscard]] unsigned held_axes(Index node) const { return model_.fixed[node] & all_axes(); }

  void add(const GradedCell& cell) {
    const std::span<const EdgeNodes> edges = element_edges(mesh_.element);
    std::array<Index, 10> local{};
    std::array<Weights, 10> weights;
    for (std::size_t k = 0; k <= d_; ++k) {
      local[k] = cell.nodes[k];
      weights[k] = cell.weights[k];
      enter(local[k], cell.parent, weights[k]);
    }
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const Index a = cell.nodes[edges[k][0]], b = cell.nodes[edges[k][1]];
      const auto [found, is_new] = middle_.emplace(std::minmax(a, b), static_cast<Index>(known_.size()));
      if (is_new) grow();
      local[d_ + 1 + k] = found->second;
      weights[d_ + 1 + k] = 0.5 * (cell.weights[edges[k][0]] + cell.weights[edges[k][1]]);
      enter(found->second, cell.parent, weights[d_ + 1 + k]);
    }
    const std::size_t nodes = d_ + 1 + edges.size();
    patch_.local.connectivity.insert(patch_.local.connectivity.end(), local.begin(),
                                     local.begin() + static_cast<std::ptrdiff_t>(nodes));
    patch_.parent.push_back(cell.parent);
    for (const OuterSide& side : sides_of(cell.parent)) find_on(side, cell, {local.data(), nodes}, weights);
  }

  void grow() {
    known_.push_back(0);
    patch_.local.nodes.emplace_back();
    patch_.rest_displacement.emplace_back();
    patch_.body_node.push_back(-1);
    zero_axes_.push_back(0);
    offset_.emplace_back(Vec3::Zero());
  }

  const std::vector<OuterSide>& sides_of(Index element) {
    const auto [found, is_new] = sides_.try_emplace(element);
    if (is_new) found->second = outer_sides(mesh_, at_, patch_.elements, element);
    return found->second;
  }

  /// Enters the position of a node, and its shape functions of the body.
  void enter(Index node, Index parent, const Weights& weights) {
    if (known_[node] != 0) return;
    known_[node] = 1;
    Vec3 xi = Vec3::Zero();
    for (std::size_t k = 0; k <= d_; ++k)
      xi += weights[static_cast<Eigen::Index>(k)] * reference_nodes(mesh_.element)[k];
    const ShapeValues N = shape_functions(mesh_.element, xi);
    const auto nodes = mesh_.element_nodes(parent);
    Vec3 position = Vec3::Zero(), rest = Vec3::Zero();
    Index coincident = -1;
    unsigned zero = all_axes();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double part = N[static_cast<Eigen::Index>(k)];
      if (std::abs(part) < least_part) continue;
      if (std::abs(part - 1.0) < least_part) coincident = nodes[k];
      position += part * mesh_.nodes[nodes[k]];
      rest += part * model_.rest_displacement[nodes[k]];
      zero &= held_axes(nodes[k]);
      const auto place = place_.find(nodes[k]);
      if (place != place_.end()) shape_.emplace_back(node, place->second, part);
    }
    patch_.local.nodes[node] = position;
    patch_.rest_displacement[node] = rest;
    patch_.body_node[node] = coincident;
    zero_axes_[node] |= coincident >= 0 ? all_axes() : zero;
  }

  [[nodiscard]] bool is_on(const OuterSide& side, const Weights& w) const {
    for (std::size_t k = 0; k <= d_; ++k) {
      if ((side.corners >> k & 1U) == 0 && w[static_cast<Eigen::Index>(k)] != 0.0) return false;
    }
    return true;
  }

  /// The facet of a cell on an outer side of its element, if it has one.
  void find_on(const OuterSide& side, const GradedCell& cell, std::span<const Index> local,
               const std::array<Weights, 10>& weights) {
    if (side.is_border) {
      for (std::size_t k = 0; k < local.size(); ++k) {
        if (is_on(side, weights[k])) zero_axes_[local[k]] = all_axes();
      }
      return;
    }
    const auto body_nodes = mesh_.element_nodes(cell.parent);
    const SideNodes& of_element = element_sides(mesh_.element)[side.number];
    for (const SideNodes& own :
         element_sides(patch_.local.element == ElementType::tet10 ? ElementType::tet10 : ElementType::tri3)) {
      const auto corners = std::span(own).first(d_);
      if (!std::ranges::all_of(corners, [&](auto k) { return is_on(side, weights[k]); })) continue;
      GradedFacet facet{};
      for (std::size_t k = 0; k < d_; ++k) {
        facet.corners[k] = body_nodes[of_element[k]];
        facet.nodes[k] = local[own[k]];
        facet.weights[k].setZero();
        for (std::size_t j = 0; j < d_; ++j)
          facet.weights[k][static_cast<Eigen::Index>(j)] = weights[own[k]][of_element[j]];
      }
      for (std::size_t k = 0; k < middles(); ++k)
        facet.nodes[d_ + k] =
            d_ == 2 ? middle_.at(std::minmax(facet.nodes[0], facet.nodes[1])) : local[own[3 + k]];
      add(facet);
    }
  }

  [[nodiscard]] std::size_t middles() const { return d_ == 2 ? 1 : 3; }  // of a facet's edges

  void add(const GradedFacet& facet) {
    for (std::size_t k = 0; k < d_ + middles(); ++k) {
      const Vec3 at = k < d_ ? facet.weights[k]
                             : Vec3(0.5 * (facet.weights[(k - d_)] + facet.weights[(k - d_ + 1) % d_]));
      std::vector<std::pair<Index, double>> parts;
      for (std::size_t j = 0; j < d_; ++j)
        parts.emplace_back(facet.corners[j], at[static_cast<Eigen::Index>(j)]);
      offset_[facet.nodes[k]] = rounding_.offset(parts);
    }
    for (std::size_t k = 0; k < d_; ++k) patch_.surface.push_back(facet.nodes[k]);
    for (std::size_t k = 0; k < middles(); ++k)
      patch_.surface.insert(patch_.surface.end(), d_, facet.nodes[d_ + k]);
    facets_.push_back(facet);
  }

  /// Moves the surface onto the rounding; a middle inside stays in the middle of its edge.
  void round_off() {
    const std::vector<Vec3> flat = patch_.local.nodes;
    for (std::size_t node = 0; node < flat.size(); ++node) patch_.local.nodes[node] += offset_[node];
    for (const auto& [ends, middle] : middle_) {
      if (offset_[middle].isZero(0.0))
        patch_.local.nodes[middle] += 0.5 * (offset_[ends.first] + offset_[ends.second]);
    }
    for (Index e = 0; e < patch_.local.elements(); ++e) {
      if (smallest_determinant(patch_.local.element, element_nodes(patch_.local, e)) > 0.0) continue;
      patch_.local.nodes = flat;
      return;
    }
  }

  const Model& model_;
  const Mesh& mesh_;
  const ElementsAtNodes& at_;
  const Rounding& rounding_;
  std::size_t d_;
  PatchMesh patch_;
  std::vector<GradedFacet> facets_;
  std::map<Index, Index> place_;                     // of the body's nodes in patch_.nodes
  std::map<std::pair<Index, Index>, Index> middle_;  // of edges
  std::map<Index, std::vector<OuterSide>> sides_;    // of elements
  std::vector<std::uint8_t> known_;                  // [local nodes]
  std::vector<Vec3> offset_;                         // [local nodes]
  std::vector<unsigned> zero_axes_;                  // [local nodes] bits of the axes along which u_L = 0
  std::vector<Eigen::Triplet<double>> shape_;
};

}  // namespace

GradedMesh make_graded_mesh(const Model& model, const ElementsAtNodes& at, const Rounding& rounding,
                            std::vector<Index> elements, const PatchFocus& focus) {
  if (traits(model.mesh.element).corners != model.dimension() + 1 || elements.empty()) {
    throw Error("a graded overlay of " + std::to_string(elements.size()) + " elements " +
                    traits(model.mesh.element).name,
                "make_graded_mesh", "take at least one tri3, tet4 or tet10");
  }
  return GradedBuilder(model, at, rounding, std::move(elements)).build(focus);
}

}  // namespace palpate
