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

/// Elements of one kind (`connectivity`: [E * nodes an element] node numbers) with nodal fields as the bytes
/// of a .vtu file: XML with raw little-endian numbers appended.
[[nodiscard]] std::string vtu_text(std::span<const Vec3> nodes, ElementType element,
                                   std::span<const Index> connectivity, std::span<const NodalField> fields);

/// Writes the same to a file by `write_file`. Throws Error when it cannot be written.
void write_vtu(const std::filesystem::path& file, std::span<const Vec3> nodes, ElementType element,
               std::span<const Index> connectivity, std::span<const NodalField> fields);

}  // namespace palpate
