#include "meshes/generate.h"

#include <algorithm>
#include <cmath>

#include "meshes/tet4.h"

namespace palpate {
namespace {

/// The unit cube's Kuhn mesh: positions as grid coordinates 0..cells, nodes x fastest.
Mesh kuhn_grid(const std::array<int, 3>& cells) {
  Mesh mesh;
  for (int k = 0; k <= cells[2]; ++k) {
    for (int j = 0; j <= cells[1]; ++j) {
      for (int i = 0; i <= cells[0]; ++i) mesh.nodes.emplace_back(i, j, k);
    }
  }
  const std::array<Index, 3> stride = {1, cells[0] + 1, (cells[0] + 1) * (cells[1] + 1)};
  for (int k = 0; k < cells[2]; ++k) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i) {
        const Index first = i * stride[0] + j * stride[1] + k * stride[2];
        std::array<std::size_t, 3> axes = {0, 1, 2};
        do {  // the paths along three cell edges from corner 000 to corner 111
          const Index second = first + stride[axes[0]], third = second + stride[axes[1]];
          Tet tet = {first, second, third, third + stride[axes[2]]};
          if (tet4::volume(tet4::corners(mesh, tet)) < 0.0) std::swap(tet[2], tet[3]);
          mesh.tets.push_back(tet);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
    }
  }
  mesh.regions.assign(mesh.tets.size(), 0);
  return mesh;
}

/// Bends the square [-1,1]^2 to the unit disc: squares about the centre become circles.
Eigen::Vector2d to_disc(double x, double y) {
  return {x * std::sqrt(1.0 - 0.5 * y * y), y * std::sqrt(1.0 - 0.5 * x * x)};
}

}  // namespace

Mesh generate(const BoxShape& shape) {
  Mesh mesh = kuhn_grid(shape.cells);
  const Vec3 cells(shape.cells[0], shape.cells[1], shape.cells[2]);
  for (Vec3& x : mesh.nodes) x = shape.origin + shape.size.cwiseProduct(x).cwiseQuotient(cells);
  return mesh;
}

}  // namespace palpate
