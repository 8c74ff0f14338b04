#include "precompute/numerics/assembly.h"

#include <algorithm>
#include <functional>

#include "meshes/averaged_strain.h"
#include "meshes/element.h"

namespace palpate {
namespace {

/// Numbers the free dofs, keeping those of a node together.
void number_dofs(const StiffnessInput& body, Stiffness& result) {
  const int d = body.mesh.dimension();
  result.free_of_dof.assign(static_cast<std::size_t>(d) * body.mesh.nodes.size(), -1);
  for (std::size_t node = 0; node < body.mesh.nodes.size(); ++node) {
    const std::size_t before = result.free_dofs.size();
    for (int axis = 0; axis < d; ++axis) {
      if ((body.fixed[node] >> axis & 1) != 0) continue;
      const std::size_t dof = static_cast<std::size_t>(d) * node + static_cast<std::size_t>(axis);
      result.free_of_dof[dof] = static_cast<std::int64_t>(result.free_dofs.size());
      result.free_dofs.push_back(static_cast<std::int64_t>(dof));
    }
    if (result.free_dofs.size() > before) result.node_start.push_back(static_cast<std::int64_t>(before));
  }
  result.node_start.push_back(static_cast<std::int64_t>(result.free_dofs.size()));
}

/// For each free node the free nodes with a higher number that are coupled with it, ascending.
struct UpperNeighbours {
  std::vector<std::int64_t> start;  ///< [nodes + 1]
  std::vector<Index> node;
};

/// Free node of each mesh node, -1 if all its dofs are held.
std::vector<Index> free_nodes(const StiffnessInput& body, const Stiffness& stiffness) {
  std::vector<Index> result(body.mesh.nodes.size(), -1);
  for (std::size_t a = 0; a + 1 < stiffness.node_start.size(); ++a) {
    const std::int64_t dof = stiffness.free_dofs[static_cast<std::size_t>(stiffness.node_start[a])];
    result[static_cast<std::size_t>(dof / body.mesh.dimension())] = static_cast<Index>(a);
  }
  return result;
}

/// Visits the nodes of each element or, of tet4a, of each node's strain domain; the domain of an edge is
/// within those of its ends.
void for_each_coupled(const StiffnessInput& body, const std::function<void(std::span<const Index>)>& visit) {
  if (body.mesh.element == ElementType::tet4a) {
    for_each_node_domain(body.mesh, body.material_of_element,
                         [&](const StrainDomain& domain) { visit(domain.nodes); });
    return;
  }
  for (Index e = 0; e < body.mesh.elements(); ++e) visit(body.mesh.element_nodes(e));
}

/// Calls f(a, b) for every two free nodes a < b of those that are coupled.
template <class F>
void for_each_free_pair(const StiffnessInput& body, const std::vector<Index>& free_node, F f) {
  for_each_coupled(body, [&](std::span<const Index> nodes) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Index a = free_node[static_cast<std::size_t>(nodes[i])];
      for (std::size_t j = i + 1; j < nodes.size(); ++j) {
        const Index b = free_node[static_cast<std::size_t>(nodes[j])];
        if (a >= 0 && b >= 0) f(std::min(a, b), std::max(a, b));
      }
    }
  });
}

UpperNeighbours find_upper_neighbours(const StiffnessInput& body, const std::vector<Index>& free_node,
                                      std::size_t nodes) {
  std::vector<std::int64_t> start(nodes + 1, 0);
  for_each_free_pair(body, free_node, [&](Index a, Index) { ++start[static_cast<std::size_t>(a) + 1]; });
  for (std::size_t a = 0; a < nodes; ++a) start[a + 1] += start[a];
  std::vector<Index> node(static_cast<std::size_t>(start[nodes]));
  std::vector<std::int64_t> next(start.begin(), start.end() - 1);
  for_each_free_pair(body, free_node, [&](Index a, Index b) {
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

/// Pattern of the lower triangle with zero values: in a column, the later dofs of its own node, then all dofs
/// of the higher neighbours.
SparseMatrix make_pattern(const UpperNeighbours& upper, const std::vector<std::int64_t>& node_start) {
  std::vector<std::int64_t> columns{0}, rows;
  for (std::size_t a = 0; a + 1 < node_start.size(); ++a) {
    for (std::int64_t column = node_start[a]; column < node_start[a + 1]; ++column) {
      for (std::int64_t row = column; row < node_start[a + 1]; ++row) rows.push_back(row);
      for (std::int64_t k = upper.start[a]; k < upper.start[a + 1]; ++k) {
        const auto b = static_cast<std::size_t>(upper.node[static_cast<std::size_t>(k)]);
        for (std::int64_t row = node_start[b]; row < node_start[b + 1]; ++row) rows.push_back(row);
      }
      columns.push_back(static_cast<std::int64_t>(rows.size()));
    }
  }
  SparseMatrix K(node_start.back(), node_start.back());
  K.resizeNonZeros(static_cast<std::int64_t>(rows.size()));
  std::copy(columns.begin(), columns.end(), K.outerIndexPtr());
  std::copy(rows.begin(), rows.end(), K.innerIndexPtr());
  std::fill_n(K.valuePtr(), K.nonZeros(), 0.0);
  return K;
}

/// Adds the stiffness of some nodes: entries between free dofs to K, those between free and held dofs times
/// the prescribed displacement to the held force.
void scatter(const StiffnessInput& body, std::span<const Index> nodes, const auto& Ke, Stiffness& result) {
  const int d = body.mesh.dimension();
  std::vector<std::int64_t> free(static_cast<std::size_t>(Ke.cols()));
  std::vector<double> prescribed(free.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (int axis = 0; axis < d; ++axis) {
      const std::size_t local = static_cast<std::size_t>(d) * i + static_cast<std::size_t>(axis);
      const std::int64_t dof = std::int64_t{d} * nodes[i] + axis;
      free[local] = result.free_of_dof[static_cast<std::size_t>(dof)];
      prescribed[local] =
          body.prescribed.empty() ? 0.0 : body.prescribed[static_cast<std::size_t>(nodes[i])][axis];
    }
  }
  for (Eigen::Index j = 0; j < Ke.cols(); ++j) {
    const std::int64_t column = free[static_cast<std::size_t>(j)];
    if (column < 0) continue;
    const std::int64_t* first = result.K.innerIndexPtr() + result.K.outerIndexPtr()[column];
    const std::int64_t* last = result.K.innerIndexPtr() + result.K.outerIndexPtr()[column + 1];
    for (Eigen::Index i = 0; i < Ke.rows(); ++i) {
      const std::int64_t row = free[static_cast<std::size_t>(i)];
      if (row < 0) {
        result.held_force[static_cast<std::size_t>(column)] +=
            Ke(i, j) * prescribed[static_cast<std::size_t>(i)];
      } else if (row >= column) {
        result.K.valuePtr()[std::lower_bound(first, last, row) - result.K.innerIndexPtr()] += Ke(i, j);
      }
    }
  }
}

}  // namespace

StiffnessInput stiffness_input(const Model& model) {
  return {model.mesh,  model.analysis,         model.thickness, model.materials, model.material_of_element,
          model.fixed, model.rest_displacement};
}

Stiffness assemble_stiffness(const StiffnessInput& body) {
  Stiffness result;
  number_dofs(body, result);
  result.held_force.assign(result.free_dofs.size(), 0.0);
  const UpperNeighbours upper =
      find_upper_neighbours(body, free_nodes(body, result), result.node_start.size() - 1);
  result.K = make_pattern(upper, result.node_start);
  if (body.mesh.element == ElementType::tet4a) {
    const auto add = [&](const StrainDomain& domain) {
      const Material& material = body.materials[static_cast<std::size_t>(domain.material)];
      scatter(body, domain.nodes, domain_stiffness(domain, material), result);
    };
    for_each_edge_domain(body.mesh, body.material_of_element, add);
    for_each_node_domain(body.mesh, body.material_of_element, add);
    return result;
  }

  std::vector<ElasticityMatrix> D;
  for (const Material& material : body.materials) D.push_back(elasticity_matrix(material, body.analysis));
  for (Index e = 0; e < body.mesh.elements(); ++e) {
    const auto material = static_cast<std::size_t>(body.material_of_element[static_cast<std::size_t>(e)]);
    const ElementMatrix Ke =
        element_stiffness(body.mesh.element, element_nodes(body.mesh, e), D[material], body.thickness);
    scatter(body, body.mesh.element_nodes(e), Ke, result);
  }
  return result;
}

SparseMatrix assemble_mass(const StiffnessInput& body, const Stiffness& stiffness, bool lumped) {
  const int d = body.mesh.dimension();
  SparseMatrix M = stiffness.K;
  std::fill_n(M.valuePtr(), M.nonZeros(), 0.0);
  const auto add = [&](Index a, Index b, double mass) {
    for (int axis = 0; axis < d; ++axis) {
      const std::int64_t row = stiffness.free_of_dof[static_cast<std::size_t>(std::int64_t{d} * a + axis)];
      const std::int64_t column = stiffness.free_of_dof[static_cast<std::size_t>(std::int64_t{d} * b + axis)];
      if (column >= 0 && row >= column) M.coeffRef(row, column) += mass;
    }
  };
  for (Index e = 0; e < body.mesh.elements(); ++e) {
    const auto material = static_cast<std::size_t>(body.material_of_element[static_cast<std::size_t>(e)]);
    const double density = body.materials[material].density;
    const std::span<const Index> nodes = body.mesh.element_nodes(e);
    const ElementNodes x = element_nodes(body.mesh, e);
    const ElementMass Me =
        lumped ? ElementMass(element_lumped_mass(body.mesh.element, x, density, body.thickness).asDiagonal())
               : element_mass(body.mesh.element, x, density, body.thickness);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (std::size_t j = 0; j < nodes.size(); ++j)
        add(nodes[i], nodes[j], Me(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
    }
  }
  return M;
}

SparseMatrix effective_stiffness(const SparseMatrix& K, const SparseMatrix& M, const Rayleigh& damping,
                                 const Newmark& newmark) {
  const double of_K = 1.0 + newmark.a1() * damping.stiffness;
  const double of_M = newmark.a0() + newmark.a1() * damping.mass;
  SparseMatrix K_bar = K;
  for (std::int64_t k = 0; k < K_bar.nonZeros(); ++k)
    K_bar.valuePtr()[k] = of_K * K.valuePtr()[k] + of_M * M.valuePtr()[k];
  return K_bar;
}

}  // namespace palpate
