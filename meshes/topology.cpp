#include "meshes/topology.h"

#include <algorithm>
#include <limits>

namespace palpate {
namespace {

constexpr std::array<SideNodes, 3> tri_sides = {{{0, 1}, {1, 2}, {2, 0}}};
constexpr std::array<SideNodes, 4> quad_sides = {{{0, 1}, {1, 2}, {2, 3}, {3, 0}}};
constexpr std::array<SideNodes, 4> tet_sides = {
    {{1, 2, 3, 5, 9, 8}, {0, 3, 2, 7, 9, 6}, {0, 1, 3, 4, 8, 7}, {0, 2, 1, 6, 5, 4}}};
constexpr std::array<SideNodes, 6> hex_sides = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};

constexpr std::array<EdgeNodes, 3> tri_edges = {{{0, 1}, {1, 2}, {2, 0}}};
constexpr std::array<EdgeNodes, 4> quad_edges = {{{0, 1}, {1, 2}, {2, 3}, {3, 0}}};
constexpr std::array<EdgeNodes, 6> tet_edges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<EdgeNodes, 12> hex_edges = {
    {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};
constexpr std::array<EdgeNodes, 1> line_edges = {{{0, 1}}};

constexpr std::array<std::uint8_t, 2> reversed_line = {1, 0};
constexpr std::array<std::uint8_t, 6> reversed_tri = {0, 2, 1, 5, 4, 3};
constexpr std::array<std::uint8_t, 4> reversed_quad = {0, 3, 2, 1};
constexpr std::array<std::uint8_t, 10> reversed_tet = {0, 1, 3, 2, 4, 8, 7, 6, 5, 9};
constexpr std::array<std::uint8_t, 8> reversed_hex = {4, 5, 6, 7, 0, 1, 2, 3};

}  // namespace

std::span<const SideNodes> element_sides(ElementType type) {
  switch (type) {
    case ElementType::tri3:
      return tri_sides;
    case ElementType::quad4:
      return quad_sides;
    case ElementType::tet4:
    case ElementType::tet4a:
    case ElementType::tet10:
      return tet_sides;
    case ElementType::hex8:
      return hex_sides;
    case ElementType::line2:
    case ElementType::tri6:
      break;
  }
  return {};
}

std::span<const EdgeNodes> element_edges(ElementType type) {
  switch (type) {
    case ElementType::line2:
      return line_edges;
    case ElementType::tri3:
    case ElementType::tri6:
      return tri_edges;
    case ElementType::quad4:
      return quad_edges;
    case ElementType::tet4:
    case ElementType::tet4a:
    case ElementType::tet10:
      return tet_edges;
    case ElementType::hex8:
      return hex_edges;
  }
  return {};
}

std::span<const std::uint8_t> reversed_nodes(ElementType type) {
  switch (type) {
    case ElementType::line2:
      return reversed_line;
    case ElementType::tri3:
      return std::span(reversed_tri).first(3);
    case ElementType::tri6:
      return reversed_tri;
    case ElementType::quad4:
      return reversed_quad;
    case ElementType::tet4:
    case ElementType::tet4a:
      return std::span(reversed_tet).first(4);
    case ElementType::tet10:
      return reversed_tet;
    case ElementType::hex8:
      return reversed_hex;
  }
  return {};
}

std::vector<ElementSide> sorted_sides(const Mesh& mesh) {
  const std::span<const SideNodes> sides = element_sides(mesh.element);
  const auto corners = static_cast<std::size_t>(traits(traits(mesh.element).facet).corners);
  std::vector<ElementSide> all;
  all.reserve(sides.size() * static_cast<std::size_t>(mesh.elements()));
  for (Index e = 0; e < mesh.elements(); ++e) {
    const std::span<const Index> nodes = mesh.element_nodes(e);
    for (std::size_t s = 0; s < sides.size(); ++s) {
      ElementSide side{{}, e, static_cast<std::uint8_t>(s)};
      side.corners.fill(std::numeric_limits<Index>::max());
      for (std::size_t i = 0; i < corners; ++i) side.corners[i] = nodes[sides[s][i]];
      std::sort(side.corners.begin(), side.corners.end());
      all.push_back(side);
    }
  }
  std::sort(all.begin(), all.end(), [](const ElementSide& a, const ElementSide& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.element < b.element;
  });
  return all;
}

std::vector<ElementSide> boundary_sides(const Mesh& mesh) {
  std::vector<ElementSide> boundary;
  const std::vector<ElementSide> sides = sorted_sides(mesh);
  for (auto side = sides.begin(); side != sides.end();) {
    const auto end =
        std::find_if(side, sides.end(), [&](const ElementSide& s) { return s.corners != side->corners; });
    if (end - side == 1) boundary.push_back(*side);
    side = end;
  }
  std::sort(boundary.begin(), boundary.end(), [](const ElementSide& a, const ElementSide& b) {
    return a.element < b.element || (a.element == b.element && a.side < b.side);
  });
  return boundary;
}

std::vector<Index> side_nodes(const Mesh& mesh, const ElementSide& side) {
  const SideNodes& local = element_sides(mesh.element)[side.side];
  std::vector<Index> nodes(static_cast<std::size_t>(traits(traits(mesh.element).facet).nodes));
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] = mesh.element_nodes(side.element)[local[i]];
  return nodes;
}

}  // namespace palpate
