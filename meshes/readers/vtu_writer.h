// VTK XML unstructured grids, for ParaView.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Named nodal values: `values` holds `components` numbers per node.
struct NodalField {
  std::string name;
  int components;
  std::span<const double> values;
};

/// Bytes of a .vtu file with elements of one kind (`connectivity`: [E * nodes per element] node numbers) and
/// nodal fields: XML with raw little-endian numbers appended.
[[nodiscard]] std::string vtu_text(std::span<const Vec3> nodes, ElementType element,
                                   std::span<const Index> connectivity, std::span<const NodalField> fields);

/// Writes `vtu_text` to a file by `write_file`. Throws Error if it cannot be written.
void write_vtu(const std::filesystem::path& file, std::span<const Vec3> nodes, ElementType element,
               std::span<const Index> connectivity, std::span<const NodalField> fields);

}  // namespace palpate
