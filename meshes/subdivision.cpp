#include "meshes/subdivision.h"

#include <Eigen/LU>
#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <string>

#include "base/error.h"
#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

using Lattice = std::array<int, 3>;

/// List of nodes without duplicates.
class NodeList {
 public:
  explicit NodeList(Subdivision& result) : result_(result) {}
  Index find(const std::array<int, 8>& weights, const Vec3& xi) {
    const auto [found, is_new] = place_.emplace(weights, static_cast<Index>(result_.nodes.size()));
    if (is_new) result_.nodes.push_back({weights, xi});
    return found->second;
  }

 private:
  Subdivision& result_;
  std::map<std::array<int, 8>, Index> place_;
};

/// Calls `visit` for the lowest corner of each cell of a lattice of r^d cells, x fastest.
template <typename Visit>
void for_each_cell(int d, int r, Visit&& visit) {
  Lattice cell{};
  const int last = d == 3 ? r : 1;
  for (cell[2] = 0; cell[2] < last; ++cell[2]) {
    for (cell[1] = 0; cell[1] < r; ++cell[1]) {
      for (cell[0] = 0; cell[0] < r; ++cell[0]) visit(cell);
    }
  }
}

/// Subdivision of a simplex. With ranked corners v_0 v_1 .. the point (x) of the lattice
/// r >= x_1 >= x_2 >= .. >= 0 is v_0 + x_1/r (v_1 - v_0) + x_2/r (v_2 - v_1) + ..; the children are Kuhn's
/// simplices, inside it, of the lattice's cells.
class SimplexCut {
 public:
  SimplexCut(ElementType type, int r, const std::array<int, 4>& order, Subdivision& result)
      : type_(type),
        d_(traits(type).dimension),
        r_(r),
        scale_(traits(type).nodes > traits(type).corners ? 2 : 1),  // middles of edges are nodes too
        order_(order),
        result_(result),
        nodes_(result) {
    result_.denominator = scale_ * r;
  }

  void cut() {
    std::array<int, 3> axes{0, 1, 2};
    do {
      for_each_cell(d_, r_, [&](const Lattice& cell) { add_child(cell, axes); });
    } while (std::next_permutation(axes.begin(), axes.begin() + d_));
  }

 private:
  using Weights = std::array<int, 8>;

  [[nodiscard]] bool is_within(const Lattice& x) const {
    for (int axis = 0; axis < d_; ++axis) {
      const auto at = static_cast<std::size_t>(axis);
      if (x[at] > (axis == 0 ? r_ : x[at - 1]) || x[at] < 0) return false;
    }
    return true;
  }

  [[nodiscard]] Weights weights_at(const Lattice& x) const {
    Weights weights{};
    int before = r_;
    for (int rank = 0; rank <= d_; ++rank) {
      const int here = rank < d_ ? x[static_cast<std::size_t>(rank)] : 0;
      const auto corner =
          static_cast<std::size_t>(std::find(order_.begin(), order_.begin() + d_ + 1, rank) - order_.begin());
      weights[corner] = scale_ * (before - here);
      before = here;
    }
    return weights;
  }

  /// Adds the node with these integer barycentric weights.
  void add_node(const Weights& weights) {
    Vec3 xi = Vec3::Zero();
    for (int axis = 0; axis < d_; ++axis)
      xi[axis] = static_cast<double>(weights[static_cast<std::size_t>(axis) + 1]) / result_.denominator;
    result_.connectivity.push_back(nodes_.find(weights, xi));
  }

  /// Adds Kuhn's simplex of the cell along `axes`, one after the other, if it is inside.
  void add_child(const Lattice& cell, const std::array<int, 3>& axes) {
    std::array<Lattice, 4> path{cell};
    for (std::size_t k = 0; k < static_cast<std::size_t>(d_); ++k) {
      path[k + 1] = path[k];
      ++path[k + 1][static_cast<std::size_t>(axes[k])];
    }
    const auto end = path.begin() + d_ + 1;
    if (!std::all_of(path.begin(), end, [&](const Lattice& x) { return is_within(x); })) return;
    std::array<Weights, 4> corner;
    std::transform(path.begin(), end, corner.begin(), [&](const Lattice& x) { return weights_at(x); });
    std::for_each(corner.begin(), corner.begin() + d_ + 1,
                  [&](const Weights& weights) { add_node(weights); });
    if (scale_ == 1) return;
    for (const EdgeNodes& edge : element_edges(type_)) {
      Weights middle{};
      for (std::size_t k = 0; k < middle.size(); ++k)
        middle[k] = (corner[edge[0]][k] + corner[edge[1]][k]) / 2;
      add_node(middle);
    }
  }

  ElementType type_;
  int d_;
  int r_;
  int scale_;
  const std::array<int, 4>& order_;
  Subdivision& result_;
  NodeList nodes_;
};

void cut_cell(ElementType type, int r, Subdivision& result) {
  const int d = traits(type).dimension;
  const std::span<const Vec3> corners = reference_nodes(type);
  result.denominator = d == 2 ? r * r : r * r * r;
  NodeList nodes(result);
  const auto node_at = [&](const Lattice& x) {
    std::array<int, 8> weights{};
    Vec3 xi = Vec3::Zero();
    for (int axis = 0; axis < d; ++axis) xi[axis] = 2.0 * x[static_cast<std::size_t>(axis)] / r - 1.0;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      weights[k] = 1;
      for (int axis = 0; axis < d; ++axis) {
        const int along = x[static_cast<std::size_t>(axis)];
        weights[k] *= corners[k][axis] > 0.0 ? along : r - along;
      }
    }
    return nodes.find(weights, xi);
  };
  for_each_cell(d, r, [&](const Lattice& cell) {
    for (const Vec3& corner : corners) {
      Lattice x = cell;
      for (int axis = 0; axis < d; ++axis) x[static_cast<std::size_t>(axis)] += corner[axis] > 0.0 ? 1 : 0;
      result.connectivity.push_back(node_at(x));
    }
  });
}

std::span<const Index> part_nodes(const Subdivision& parts, ElementType type, std::size_t part) {
  const auto width = static_cast<std::size_t>(traits(type).nodes);
  return {parts.connectivity.data() + part * width, width};
}

std::size_t count_parts(const Subdivision& parts, ElementType type) {
  return parts.connectivity.size() / static_cast<std::size_t>(traits(type).nodes);
}

void orient(ElementType type, Subdivision& result) {
  const int d = traits(type).dimension;
  for (std::size_t part = 0; part < count_parts(result, type); ++part) {
    const std::span<const Index> found = part_nodes(result, type, part);
    const std::vector<Index> nodes(found.begin(), found.end());
    const auto xi = [&](int corner) -> const Vec3& {
      return result.nodes[static_cast<std::size_t>(nodes[static_cast<std::size_t>(corner)])].xi;
    };
    Eigen::Matrix3d edges = Eigen::Matrix3d::Identity();
    for (int axis = 0; axis < d; ++axis) edges.col(axis) = xi(axis + 1) - xi(0);
    if (edges.determinant() > 0.0) continue;
    for (std::size_t k = 0; k < nodes.size(); ++k)
      result.connectivity[part * nodes.size() + k] = nodes[reversed_nodes(type)[k]];
  }
}

void find_sides(ElementType type, Subdivision& result) {
  const ElementTraits& facet = traits(traits(type).facet);
  for (const SideNodes& side : element_sides(type)) {
    const auto is_on = [&](Index node) {
      const std::array<int, 8>& weights = result.nodes[static_cast<std::size_t>(node)].weights;
      int sum = 0;
      for (int k = 0; k < facet.corners; ++k) sum += weights[side[static_cast<std::size_t>(k)]];
      return sum == result.denominator;
    };
    std::vector<Index>& facets = result.sides.emplace_back();
    for (std::size_t part = 0; part < count_parts(result, type); ++part) {
      const std::span<const Index> nodes = part_nodes(result, type, part);
      for (const SideNodes& part_side : element_sides(type)) {
        const auto end = part_side.begin() + facet.nodes;
        if (!std::all_of(part_side.begin(), end, [&](std::uint8_t k) { return is_on(nodes[k]); })) continue;
        std::transform(part_side.begin(), end, std::back_inserter(facets),
                       [&](std::uint8_t k) { return nodes[k]; });
      }
    }
  }
}

}  // namespace

Subdivision subdivide(ElementType type, int r, const std::array<int, 4>& order) {
  if (r < 1) {
    throw Error("a refinement of " + std::to_string(r) + " was asked for", "subdivide",
                "give 1 (as it is) or more");
  }
  Subdivision result;
  if (type == ElementType::quad4 || type == ElementType::hex8) {
    cut_cell(type, r, result);
  } else {
    SimplexCut(type, r, order, result).cut();
    orient(type, result);
  }
  find_sides(type, result);
  return result;
}

}  // namespace palpate
