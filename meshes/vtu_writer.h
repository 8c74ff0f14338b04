// VTK XML unstructured grids, for ParaView.
#pragma once

#include <filesystem>
#include <iosfwd>
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

/// Writes elements of one kind (`connectivity`: [E * nodes an element] node numbers) with nodal fields as
/// ASCII-free appended raw .vtu; under a temporary name, then renamed. Throws Error when the file cannot be
/// written.
void write_vtu(const std::filesystem::path& file, std::span<const Vec3> nodes, ElementType element,
               std::span<const Index> connectivity, std::span<const NodalField> fields);

/// The same into a stream; whether that could take it, the stream says.
void write_vtu(std::ostream& stream, std::span<const Vec3> nodes, ElementType element,
               std::span<const Index> connectivity, std::span<const NodalField> fields);

}  // namespace palpate
