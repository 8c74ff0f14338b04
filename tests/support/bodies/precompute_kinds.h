// Every kind of element that a body can be made of, with every way to use it, and blocks made of them.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>
#include <vector>

#include "meshes/generate.h"
#include "meshes/material.h"

namespace palpate::test {

struct Kind {
  ElementType element;
  Analysis analysis;
  [[nodiscard]] int dimension() const { return traits(element).dimension; }
};

inline const std::vector<Kind> all_kinds = {
    {ElementType::tri3, Analysis::plane_stress},  {ElementType::tri3, Analysis::plane_strain},
    {ElementType::quad4, Analysis::plane_stress}, {ElementType::quad4, Analysis::plane_strain},
    {ElementType::tet4, Analysis::solid},         {ElementType::tet4a, Analysis::solid},
    {ElementType::tet10, Analysis::solid},        {ElementType::hex8, Analysis::solid}};

inline std::string name_of(const testing::TestParamInfo<Kind>& info) {
  std::string name = traits(info.param.element).name;
  if (info.param.analysis == Analysis::plane_stress) name += "_plane_stress";
  if (info.param.analysis == Analysis::plane_strain) name += "_plane_strain";
  return name;
}

/// Block [0, size] of cells of the kind; in the plane the rectangle of the first two sides. move(x) says
/// where the corners of the elements go; edges stay straight.
template <class Move>
Mesh block(ElementType element, const Vec3& size, const std::array<int, 3>& cells, Move move) {
  Mesh mesh;
  if (traits(element).dimension == 2) {
    mesh = generate(RectangleShape{Vec3::Zero(), {size.x(), size.y(), 0.0}, {cells[0], cells[1]}}, element);
  } else {
    mesh = generate(BoxShape{Vec3::Zero(), size, cells},
                    element == ElementType::hex8 ? ElementType::hex8 : ElementType::tet4);
  }
  for (Vec3& x : mesh.nodes) x = move(x);
  return with_elements(std::move(mesh), element, "block");
}

inline Mesh block(ElementType element, const Vec3& size, const std::array<int, 3>& cells) {
  return block(element, size, cells, [](const Vec3& x) { return x; });
}

/// Whether x is on the boundary of the block [0, size].
inline bool on_boundary(const Vec3& x, const Vec3& size, int dimension) {
  for (int axis = 0; axis < dimension; ++axis) {
    if (x[axis] < 1e-9 * size[axis] || x[axis] > (1.0 - 1e-9) * size[axis]) return true;
  }
  return false;
}

/// A block whose inner nodes are moved at random by up to a fifth of a cell in each direction.
inline Mesh distorted_block(ElementType element, const Vec3& size, const std::array<int, 3>& cells) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-0.2, 0.2);
  const int d = traits(element).dimension;
  return block(element, size, cells, [&](Vec3 x) {
    if (on_boundary(x, size, d)) return x;
    for (int axis = 0; axis < d; ++axis) {
      x[axis] += shift(random) * size[axis] / cells[static_cast<std::size_t>(axis)];
    }
    return x;
  });
}

}  // namespace palpate::test
