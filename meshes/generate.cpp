#include "meshes/generate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshes/tet4.h"

namespace palpate {
namespace {

/// Kuhn mesh of a grid of unit cells centred on the origin, nodes x fastest: each cell is the six tetrahedra
/// along the diagonal from its corner 000 to its corner 111. Along a `mirrored` axis the lower half is the
/// mirror image of the upper one, so that diagonals leave the middle.
Mesh kuhn_grid(const std::array<int, 3>& cells, const std::array<bool, 3>& mirrored) {
  Mesh mesh;
  for (int k = 0; k <= cells[2]; ++k) {
    for (int j = 0; j <= cells[1]; ++j) {
      for (int i = 0; i <= cells[0]; ++i) {
        mesh.nodes.emplace_back(i - 0.5 * cells[0], j - 0.5 * cells[1], k - 0.5 * cells[2]);
      }
    }
  }
  const std::array<Index, 3> stride = {1, cells[0] + 1, (cells[0] + 1) * (cells[1] + 1)};
  const auto add_cell = [&](const std::array<int, 3>& cell) {
    Index first = 0;
    std::array<Index, 3> step{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool backwards = mirrored[axis] && 2 * cell[axis] < cells[axis];
      first += stride[axis] * (backwards ? cell[axis] + 1 : cell[axis]);
      step[axis] = backwards ? -stride[axis] : stride[axis];
    }
    std::array<std::size_t, 3> axes = {0, 1, 2};
    do {  // the paths along three cell edges from corner 000 to corner 111
      const Index second = first + step[axes[0]], third = second + step[axes[1]];
      Tet tet = {first, second, third, third + step[axes[2]]};
      if (tet4::volume(tet4::corners(mesh, tet)) < 0.0) std::swap(tet[2], tet[3]);
      mesh.tets.push_back(tet);
    } while (std::next_permutation(axes.begin(), axes.end()));
  };
  for (int k = 0; k < cells[2]; ++k) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i) add_cell({i, j, k});
    }
  }
  mesh.regions.assign(mesh.tets.size(), 0);
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

}  // namespace

Mesh generate(const BoxShape& shape) {
  Mesh mesh = kuhn_grid(shape.cells, {false, false, false});
  const Vec3 cells(shape.cells[0], shape.cells[1], shape.cells[2]);
  for (Vec3& x : mesh.nodes) {
    x = shape.origin + shape.size.cwiseProduct(x + 0.5 * cells).cwiseQuotient(cells);
  }
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

}  // namespace palpate
