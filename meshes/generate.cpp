#include "meshes/generate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "base/error.h"
#include "meshes/check.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

/// Nodes of a grid of unit cells centred on the origin, x fastest.
std::vector<Vec3> grid_nodes(const std::array<int, 3>& cells) {
  std::vector<Vec3> nodes;
  for (int k = 0; k <= cells[2]; ++k) {
    for (int j = 0; j <= cells[1]; ++j) {
      for (int i = 0; i <= cells[0]; ++i) {
        nodes.emplace_back(i - 0.5 * cells[0], j - 0.5 * cells[1], k - 0.5 * cells[2]);
      }
    }
  }
  return nodes;
}

/// Increments of the node number along the axes.
std::array<Index, 3> strides(const std::array<int, 3>& cells) {
  return {1, cells[0] + 1, (cells[0] + 1) * (cells[1] + 1)};
}

template <class AddCell>
void for_each_cell(const std::array<int, 3>& cells, AddCell add_cell) {
  for (int k = 0; k < cells[2]; ++k) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i) add_cell(std::array<int, 3>{i, j, k});
    }
  }
}

void add_element(Mesh& mesh, std::initializer_list<Index> nodes) {
  mesh.connectivity.insert(mesh.connectivity.end(), nodes);
}

/// Kuhn mesh of a grid: each cell is the six tetrahedra along the diagonal from its corner 000 to its corner
/// 111. Along a `mirrored` axis the lower half is the mirror image of the upper one, so that diagonals leave
/// the middle.
Mesh kuhn_grid(const std::array<int, 3>& cells, const std::array<bool, 3>& mirrored) {
  Mesh mesh;
  mesh.nodes = grid_nodes(cells);
  const std::array<Index, 3> stride = strides(cells);
  for_each_cell(cells, [&](const std::array<int, 3>& cell) {
    Index first = 0;
    std::array<Index, 3> step{};
    bool odd_mirrors = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool backwards = mirrored[axis] && 2 * cell[axis] < cells[axis];
      first += stride[axis] * (backwards ? cell[axis] + 1 : cell[axis]);
      step[axis] = backwards ? -stride[axis] : stride[axis];
      odd_mirrors = odd_mirrors != backwards;
    }
    std::array<std::size_t, 3> axes = {0, 1, 2};
    do {  // the paths along three cell edges from corner 000 to corner 111
      const Index second = first + step[axes[0]], third = second + step[axes[1]],
                  last = third + step[axes[2]];
      const bool even_path = (axes[1] + 3 - axes[0]) % 3 == 1;
      if (even_path != odd_mirrors) {
        add_element(mesh, {first, second, third, last});
      } else {
        add_element(mesh, {first, second, last, third});
      }
    } while (std::next_permutation(axes.begin(), axes.end()));
  });
  mesh.regions.assign(static_cast<std::size_t>(mesh.elements()), 0);
  return mesh;
}

Mesh hex_grid(const std::array<int, 3>& cells) {
  Mesh mesh;
  mesh.element = ElementType::hex8;
  mesh.nodes = grid_nodes(cells);
  const auto [x, y, z] = strides(cells);
  for_each_cell(cells, [&, x = x, y = y, z = z](const std::array<int, 3>& cell) {
    const Index a = x * cell[0] + y * cell[1] + z * cell[2];
    add_element(mesh, {a, a + x, a + x + y, a + y, a + z, a + x + z, a + x + y + z, a + y + z});
  });
  mesh.regions.assign(static_cast<std::size_t>(mesh.elements()), 0);
  return mesh;
}

/// Bends the cube [-1,1]^3 to the unit ball (the square z = 0 to the unit disc): cubes about the origin
/// become spheres, and equal steps along a cube face become equal angles.
Vec3 to_ball(const Vec3& x) {
  const double radius = x.cwiseAbs().maxCoeff();
  if (radius == 0.0) return x;
  const auto tangent = [&](double t) {
    return std::abs(t) == radius ? std::copysign(1.0, t) : std::tan(std::numbers::pi / 4.0 * t / radius);
  };
  return radius * x.unaryExpr(tangent).normalized();
}

Error wrong_kind(ElementType has, ElementType wanted, const std::string& where) {
  return {
      fmt::format("the mesh has {} elements, which cannot be made {}", traits(has).name, traits(wanted).name),
      where, fmt::format("Ask for {} elements, or give another mesh", traits(has).name)};
}

/// The node in the middle of each edge of a mesh.
class MiddleNodes {
 public:
  /// The middle of the edge from a to b, added to `nodes` where it is new.
  Index of(Index a, Index b, std::vector<Vec3>& nodes) {
    const auto [place, is_new] = middles_.try_emplace(key(a, b), static_cast<Index>(nodes.size()));
    if (is_new) {
      const Vec3 sum = nodes[static_cast<std::size_t>(a)] + nodes[static_cast<std::size_t>(b)];
      nodes.emplace_back(0.5 * sum);
    }
    return place->second;
  }

 private:
  static std::uint64_t key(Index a, Index b) {
    const auto [low, high] = std::minmax(a, b);
    return static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high);
  }
  std::unordered_map<std::uint64_t, Index> middles_;
};

/// Connectivity of first-order elements or facets, with their middle nodes added.
std::vector<Index> with_middles(const std::vector<Index>& connectivity, ElementType linear,
                                MiddleNodes& middles, std::vector<Vec3>& nodes) {
  const auto width = static_cast<std::size_t>(traits(linear).nodes);
  std::vector<Index> result;
  for (std::size_t first = 0; first < connectivity.size(); first += width) {
    const std::span<const Index> corners(connectivity.data() + first, width);
    result.insert(result.end(), corners.begin(), corners.end());
    for (const auto& [a, b] : element_edges(linear)) {
      result.push_back(middles.of(corners[a], corners[b], nodes));
    }
  }
  return result;
}

std::vector<Index> without_middles(const std::vector<Index>& connectivity, ElementType quadratic) {
  const auto width = static_cast<std::size_t>(traits(quadratic).nodes),
             corners = static_cast<std::size_t>(traits(quadratic).corners);
  std::vector<Index> result;
  for (std::size_t first = 0; first < connectivity.size(); first += width) {
    const std::span<const Index> nodes(connectivity.data() + first, corners);
    result.insert(result.end(), nodes.begin(), nodes.end());
  }
  return result;
}

}  // namespace

Mesh generate(const BoxShape& shape, ElementType element) {
  if (element != ElementType::tet4 && element != ElementType::tet4a && element != ElementType::hex8) {
    throw wrong_kind(ElementType::tet4, element, "box");
  }
  Mesh mesh =
      element == ElementType::hex8 ? hex_grid(shape.cells) : kuhn_grid(shape.cells, {false, false, false});
  mesh.element = element;
  const Vec3 cells(shape.cells[0], shape.cells[1], shape.cells[2]);
  for (Vec3& x : mesh.nodes) {
    x = shape.origin + shape.size.cwiseProduct(x + 0.5 * cells).cwiseQuotient(cells);
  }
  return mesh;
}

Mesh generate(const RectangleShape& shape, ElementType element) {
  if (element != ElementType::quad4 && element != ElementType::tri3) {
    throw wrong_kind(ElementType::quad4, element, "rectangle");
  }
  Mesh mesh;
  mesh.element = element;
  const auto [nx, ny] = shape.cells;
  for (int j = 0; j <= ny; ++j) {
    for (int i = 0; i <= nx; ++i) {
      mesh.nodes.emplace_back(shape.origin.x() + shape.size.x() * i / nx,
                              shape.origin.y() + shape.size.y() * j / ny, 0.0);
    }
  }
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const Index a = i + (nx + 1) * j, b = a + 1, c = b + nx + 1, d = a + nx + 1;
      if (element == ElementType::quad4) {
        add_element(mesh, {a, b, c, d});
      } else {
        add_element(mesh, {a, b, c});
        add_element(mesh, {a, c, d});
      }
    }
  }
  mesh.regions.assign(static_cast<std::size_t>(mesh.elements()), 0);
  return mesh;
}

Mesh generate(const CylinderShape& shape) {
  const int across = shape.cells_across, along = shape.cells_along;
  // The diagonals of the cells at the square's corners must end there: a triangle that had the whole corner
  // would be flat on the circle.
  Mesh mesh = kuhn_grid({across, across, along}, {true, true, false});
  for (Vec3& x : mesh.nodes) {
    const double height = shape.height * (x.z() / along + 0.5);
    x = shape.radius * to_ball({2.0 * x.x() / across, 2.0 * x.y() / across, 0.0});
    x.z() = height;
  }
  return mesh;
}

Mesh generate(const SphereShape& shape) {
  const int across = shape.cells_across;
  Mesh mesh = kuhn_grid({across, across, across}, {true, true, true});
  for (Vec3& x : mesh.nodes) x = shape.radius * to_ball(2.0 / across * x);
  return mesh;
}

Mesh with_elements(Mesh mesh, ElementType element, const std::string& where) {
  const auto is_linear = [](ElementType type) {
    return type == ElementType::tet4 || type == ElementType::tet4a;
  };
  if (mesh.element == element || (is_linear(mesh.element) && is_linear(element))) {
    mesh.element = element;
    return mesh;
  }
  if (is_linear(mesh.element) && element == ElementType::tet10) {
    MiddleNodes middles;
    mesh.connectivity = with_middles(mesh.connectivity, ElementType::tet4, middles, mesh.nodes);
    mesh.tagged_facets = with_middles(mesh.tagged_facets, ElementType::tri3, middles, mesh.nodes);
  } else if (mesh.element == ElementType::tet10 && is_linear(element)) {
    mesh.connectivity = without_middles(mesh.connectivity, ElementType::tet10);
    mesh.tagged_facets = without_middles(mesh.tagged_facets, ElementType::tri6);
    mesh.element = ElementType::tet4;
    remove_unused_nodes(mesh);
  } else {
    throw wrong_kind(mesh.element, element, where);
  }
  mesh.element = element;
  return mesh;
}

}  // namespace palpate
