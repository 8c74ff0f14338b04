#include "meshes/averaged_strain.h"

#include <algorithm>
#include <tuple>

#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

constexpr double most_of_edges = 2.0;  // lambda over mu that is averaged over edges

/// An element beside an edge or, with equal ends, a node.
struct Beside {
  Index first, second, material, element;

  [[nodiscard]] auto domain() const noexcept { return std::tie(first, second, material); }
  bool operator<(const Beside& other) const noexcept {
    return std::tie(first, second, material, element) <
           std::tie(other.first, other.second, other.material, other.element);
  }
};

std::vector<Beside> beside_edges(const Mesh& mesh, std::span<const Index> material_of_element) {
  std::vector<Beside> all;
  for (Index e = 0; e < mesh.elements(); ++e) {
    const std::span<const Index> nodes = mesh.element_nodes(e);
    for (const auto& [i, j] : element_edges(mesh.element)) {
      const auto [first, second] = std::minmax(nodes[i], nodes[j]);
      all.push_back({first, second, material_of_element[static_cast<std::size_t>(e)], e});
    }
  }
  return all;
}

std::vector<Beside> beside_nodes(const Mesh& mesh, std::span<const Index> material_of_element) {
  std::vector<Beside> all;
  for (Index e = 0; e < mesh.elements(); ++e) {
    for (const Index node : mesh.element_nodes(e))
      all.push_back({node, node, material_of_element[static_cast<std::size_t>(e)], e});
  }
  return all;
}

/// Fills a domain from the elements in it, each of which gives it `share` of its volume.
void measure(const Mesh& mesh, std::span<const Beside> elements, double share, StrainDomain& domain) {
  domain.nodes.clear();
  for (const Beside& beside : elements) {
    const std::span<const Index> nodes = mesh.element_nodes(beside.element);
    domain.nodes.insert(domain.nodes.end(), nodes.begin(), nodes.end());
  }
  std::sort(domain.nodes.begin(), domain.nodes.end());
  domain.nodes.erase(std::unique(domain.nodes.begin(), domain.nodes.end()), domain.nodes.end());
  domain.gradients.setZero(std::ssize(domain.nodes), 3);
  domain.volume = 0.0;
  const Vec3 centre = quadrature(mesh.element).front().xi;
  for (const Beside& beside : elements) {
    const ElementNodes x = element_nodes(mesh, beside.element);
    const double volume = share * element_volume(mesh.element, x);
    const ShapeGradients gradients = mapped_gradients(mesh.element, x, centre).gradients;
    Eigen::Index k = 0;
    for (const Index node : mesh.element_nodes(beside.element)) {
      const auto place = std::lower_bound(domain.nodes.begin(), domain.nodes.end(), node);
      domain.gradients.row(place - domain.nodes.begin()) += volume * gradients.row(k++);
    }
    domain.volume += volume;
  }
  domain.gradients /= domain.volume;
}

void visit_all(const Mesh& mesh, std::vector<Beside> all, double share,
               const std::function<void(const StrainDomain&)>& visit) {
  std::sort(all.begin(), all.end());
  StrainDomain domain;
  for (auto first = all.begin(); first != all.end();) {
    const auto end = std::find_if(first, all.end(),
                                  [&](const Beside& other) { return other.domain() != first->domain(); });
    domain.is_of_edge = first->first != first->second;
    domain.material = first->material;
    measure(mesh, {first, end}, share, domain);
    visit(domain);
    first = end;
  }
}

}  // namespace

void for_each_edge_domain(const Mesh& mesh, std::span<const Index> material_of_element,
                          const std::function<void(const StrainDomain&)>& visit) {
  visit_all(mesh, beside_edges(mesh, material_of_element), 1.0 / traits(mesh.element).edges, visit);
}

void for_each_node_domain(const Mesh& mesh, std::span<const Index> material_of_element,
                          const std::function<void(const StrainDomain&)>& visit) {
  visit_all(mesh, beside_nodes(mesh, material_of_element), 1.0 / traits(mesh.element).nodes, visit);
}

Eigen::MatrixXd domain_stiffness(const StrainDomain& domain, const Material& material) {
  const double all_mu = shear_modulus(material), all_lambda = lame_lambda(material),
               of_edges = std::min(all_lambda, most_of_edges * all_mu);
  const double mu = domain.is_of_edge ? all_mu : 0.0,
               lambda = domain.is_of_edge ? of_edges : all_lambda - of_edges;
  const Eigen::Index nodes = domain.gradients.rows();
  Eigen::MatrixXd K(3 * nodes, 3 * nodes);
  for (Eigen::Index a = 0; a < nodes; ++a) {
    const Vec3 of_a = domain.volume * domain.gradients.row(a).transpose();
    for (Eigen::Index b = 0; b < nodes; ++b) {
      const Vec3 of_b = domain.gradients.row(b).transpose();
      K.block<3, 3>(3 * a, 3 * b) = lambda * of_a * of_b.transpose() + mu * of_b * of_a.transpose() +
                                    mu * of_a.dot(of_b) * Mat3::Identity();
    }
  }
  return K;
}

}  // namespace palpate
