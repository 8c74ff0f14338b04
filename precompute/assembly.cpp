#include "precompute/assembly.h"

#include <algorithm>
#include <array>

#include "meshes/tet4.h"

namespace palpate {
namespace {

/// For each free node the free nodes with a higher number that share an element with it, ascending.
struct UpperNeighbours {
  std::vector<std::int64_t> start;  ///< [nodes + 1]
  std::vector<Index> node;
};

/// Calls f(a, b) with free nodes a < b for the six edges of each element that join two free nodes.
template <class F>
void for_each_free_edge(const Mesh& mesh, const std::vector<Index>& free_of_node, F f) {
  for (const Tet& tet : mesh.tets) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) {
        const Index a = free_of_node[static_cast<std::size_t>(tet[i])];
        const Index b = free_of_node[static_cast<std::size_t>(tet[j])];
        if (a >= 0 && b >= 0) f(std::min(a, b), std::max(a, b));
      }
    }
  }
}

UpperNeighbours find_upper_neighbours(const Mesh& mesh, const std::vector<Index>& free_of_node,
                                      std::size_t nodes) {
  std::vector<std::int64_t> start(nodes + 1, 0);
  for_each_free_edge(mesh, free_of_node, [&](Index a, Index) { ++start[static_cast<std::size_t>(a) + 1]; });
  for (std::size_t a = 0; a < nodes; ++a) start[a + 1] += start[a];
  std::vector<Index> node(static_cast<std::size_t>(start[nodes]));
  std::vector<std::int64_t> next(start.begin(), start.end() - 1);
  for_each_free_edge(mesh, free_of_node, [&](Index a, Index b) {
    node[static_cast<std::size_t>(next[static_cast<std::size_t>(a)]++)] = b;
  });

  UpperNeighbours unique{{0}, {}};
  for (std::size_t a = 0; a < nodes; ++a) {
    const auto first = node.begin() + start[a];
    const auto last = node.begin() + start[a + 1];
    std::sort(first, last);
    unique.node.insert(unique.node.end(), first, std::unique(first, last));
    unique.start.push_back(static_cast<std::int64_t>(unique.node.size()));
  }
  return unique;
}

/// The lower triangle's pattern with zero values: in column 3 a + i the rows 3 a + i .. 3 a + 2, then three
/// rows for each higher neighbour.
SparseMatrix make_pattern(const UpperNeighbours& upper) {
  const auto nodes = static_cast<std::int64_t>(upper.start.size()) - 1;
  SparseMatrix K(3 * nodes, 3 * nodes);
  K.resizeNonZeros(6 * nodes + 9 * static_cast<std::int64_t>(upper.node.size()));
  std::int64_t entry = 0;
  for (std::int64_t a = 0; a < nodes; ++a) {
    const auto node = static_cast<std::size_t>(a);
    for (std::int64_t i = 0; i < 3; ++i) {
      K.outerIndexPtr()[3 * a + i] = entry;
      for (std::int64_t row = 3 * a + i; row < 3 * a + 3; ++row) K.innerIndexPtr()[entry++] = row;
      for (std::int64_t k = upper.start[node]; k < upper.start[node + 1]; ++k) {
        for (std::int64_t j = 0; j < 3; ++j)
          K.innerIndexPtr()[entry++] = std::int64_t{3} * upper.node[static_cast<std::size_t>(k)] + j;
      }
    }
  }
  K.outerIndexPtr()[3 * nodes] = entry;
  std::fill_n(K.valuePtr(), entry, 0.0);
  return K;
}

}  // namespace

Stiffness assemble_stiffness(const Mesh& mesh, const Material& material,
                             const std::vector<std::uint8_t>& fixed) {
  Stiffness result;
  result.free_of_node.assign(mesh.nodes.size(), -1);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (fixed[node]) continue;
    result.free_of_node[node] = static_cast<Index>(result.free_nodes.size());
    result.free_nodes.push_back(static_cast<Index>(node));
  }
  const UpperNeighbours upper = find_upper_neighbours(mesh, result.free_of_node, result.free_nodes.size());
  result.K = make_pattern(upper);

  const Matrix6 D = elasticity_matrix(material);
  for (const Tet& tet : mesh.tets) {
    const tet4::Stiffness Ke = tet4::stiffness(tet4::corners(mesh, tet), D);
    for (std::size_t p = 0; p < 4; ++p) {
      const Index a = result.free_of_node[static_cast<std::size_t>(tet[p])];
      if (a < 0) continue;
      for (std::size_t q = 0; q < 4; ++q) {
        const Index b = result.free_of_node[static_cast<std::size_t>(tet[q])];
        if (b < a) continue;
        const auto block = Ke.block<3, 3>(static_cast<Eigen::Index>(3 * q), static_cast<Eigen::Index>(3 * p));
        const auto first = upper.node.begin() + upper.start[static_cast<std::size_t>(a)];
        const auto last = upper.node.begin() + upper.start[static_cast<std::size_t>(a) + 1];
        const std::int64_t k = std::lower_bound(first, last, b) - first;
        for (Eigen::Index i = 0; i < 3; ++i) {
          double* column = result.K.valuePtr() + result.K.outerIndexPtr()[std::int64_t{3} * a + i];
          if (a == b) {
            for (Eigen::Index j = i; j < 3; ++j) column[j - i] += block(j, i);
          } else {
            for (Eigen::Index j = 0; j < 3; ++j) column[(3 - i) + 3 * k + j] += block(j, i);
          }
        }
      }
    }
  }
  return result;
}

}  // namespace palpate
