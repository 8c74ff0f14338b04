// Kinds of elements and of their facets.
#pragma once

#include <array>
#include <cstdint>

namespace palpate {

/// Elements of bodies (tri3 and quad4 in the plane; tet4, tet4a, tet10 and hex8 in space) and of their
/// boundaries (line2; tri3, tri6 and quad4). Nodes are numbered as VTK numbers them: corners first, in a
/// positive sense; then the middles of the edges (tri6: 01 12 20; tet10: 01 12 20 03 13 23). tet4a is tet4
/// whose strain is averaged over edges and nodes (averaged_strain.h).
enum class ElementType : std::uint8_t { line2, tri3, tri6, quad4, tet4, tet10, hex8, tet4a };

/// Constants of a kind of element.
struct ElementTraits {
  ElementType type;
  const char* name;   ///< name in model.toml
  int dimension;      ///< of its reference coordinates
  int nodes;          ///< number of nodes
  int corners;        ///< the first nodes, which fix the straight-edged shape
  int edges;          ///< straight edges
  int facets;         ///< sides
  ElementType facet;  ///< kind of its sides; line2 has none
  std::uint8_t vtk;   ///< VTK cell type
};

inline constexpr std::array<ElementTraits, 8> element_traits = {{
    {ElementType::line2, "line2", 1, 2, 2, 1, 0, ElementType::line2, 3},
    {ElementType::tri3, "tri3", 2, 3, 3, 3, 3, ElementType::line2, 5},
    {ElementType::tri6, "tri6", 2, 6, 3, 3, 0, ElementType::line2, 22},
    {ElementType::quad4, "quad4", 2, 4, 4, 4, 4, ElementType::line2, 9},
    {ElementType::tet4, "tet4", 3, 4, 4, 6, 4, ElementType::tri3, 10},
    {ElementType::tet10, "tet10", 3, 10, 4, 6, 4, ElementType::tri6, 24},
    {ElementType::hex8, "hex8", 3, 8, 8, 12, 6, ElementType::quad4, 12},
    {ElementType::tet4a, "tet4a", 3, 4, 4, 6, 4, ElementType::tri3, 10},
}};

/// Kinds of elements that bodies are made of.
inline constexpr std::array<ElementType, 6> body_elements = {ElementType::tri3,  ElementType::quad4,
                                                             ElementType::tet4,  ElementType::tet4a,
                                                             ElementType::tet10, ElementType::hex8};

constexpr const ElementTraits& traits(ElementType type) noexcept {
  return element_traits[static_cast<std::size_t>(type)];
}

/// Largest number of nodes of an element.
inline constexpr int max_element_nodes = 10;

}  // namespace palpate
