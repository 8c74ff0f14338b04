// VTK XML unstructured grids, for ParaView.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Named nodal values: `values` holds `components` numbers a node.
struct NodalField {
  std::string name;
  int components;
  std::span<const double> values;
};

/// Writes tetrahedra (`triangles` empty) or a triangle surface (`tets` empty) with nodal fields as ASCII-free
/// appended raw .vtu; under a temporary name, then renamed. Throws Error when the file cannot be written.
void write_vtu(const std::filesystem::path& file, std::span<const Vec3> nodes, std::span<const Tet> tets,
               std::span<const Triangle> triangles, std::span<const NodalField> fields);

}  // namespace palpate
