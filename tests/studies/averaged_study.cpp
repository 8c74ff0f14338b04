// How much a touch gives way on linear tetrahedra whose strain is averaged, against tet10 of the same mesh.
//
//   averaged_study FILE [RADIUS]
//     pressure exp(-r^2 / RADIUS^2), 8 mm by default, at twelve places of a baked body of tetrahedra, of one
//     material; by Poisson's ratio, and by how much of lambda is averaged over edges and not over nodes
//     (meshes/averaged_strain.h). scripts/measure runs it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "meshes/element.h"
#include "meshes/generate.h"
#include "meshes/topology.h"
#include "precompute/numerics/assembly.h"
#include "precompute/numerics/factor.h"

namespace palpate {
namespace {

constexpr double mu = 2e3;  // [Pa]
constexpr std::size_t places = 12;

struct Body {
  Mesh mesh;
  std::vector<std::uint8_t> fixed;
  std::vector<Index> material_of_element;
};

/// A body by elements of another kind; middles of edges are held where both ends are.
Body body_of(const Model& model, ElementType element) {
  Body body{with_elements(model.mesh, element, ""), model.fixed, {}};
  body.material_of_element.assign(static_cast<std::size_t>(body.mesh.elements()), 0);
  body.fixed.resize(body.mesh.nodes.size(), 0);
  const std::span<const EdgeNodes> edges = element_edges(element);
  for (Index e = 0; element == ElementType::tet10 && e < body.mesh.elements(); ++e) {
    const std::span<const Index> nodes = body.mesh.element_nodes(e);
    for (std::size_t k = 0; k < edges.size(); ++k) {
      body.fixed[static_cast<std::size_t>(nodes[4 + k])] =
          body.fixed[static_cast<std::size_t>(nodes[edges[k][0]])] &
          body.fixed[static_cast<std::size_t>(nodes[edges[k][1]])];
    }
  }
  return body;
}

Stiffness stiffness_of(const Body& body, double lambda) {
  const double nu = 0.5 * lambda / (lambda + mu);
  const std::vector<Material> materials = {{2.0 * mu * (1.0 + nu), nu}};
  return assemble_stiffness(
      {body.mesh, Analysis::solid, 1.0, materials, body.material_of_element, body.fixed, {}});
}

/// Work of a pressure of 1 N in all around each place [J].
std::vector<double> works(const Body& body, const Stiffness& stiffness, double radius) {
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  const std::vector<ElementSide> sides = boundary_sides(body.mesh);
  std::vector<Vec3> centre, normal;
  std::vector<std::size_t> free;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    const ElementNodes x = positions(body.mesh, side_nodes(body.mesh, sides[s]));
    const Vec3 a = x.row(0), b = x.row(1), c = x.row(2);
    centre.emplace_back((a + b + c) / 3.0);
    normal.push_back((b - a).cross(c - a).normalized());
    const auto nodes = side_nodes(body.mesh, sides[s]);
    if (std::all_of(nodes.begin(), nodes.end(),
                    [&](Index n) { return body.fixed[static_cast<std::size_t>(n)] == 0; }))
      free.push_back(s);
  }
  std::vector<double> result;
  for (std::size_t place = 0; place < places; ++place) {
    const std::size_t middle = free[(2 * place + 1) * free.size() / (2 * places)];
    std::vector<double> f(stiffness.free_dofs.size(), 0.0);
    double sum = 0.0;
    for (std::size_t s = 0; s < sides.size(); ++s) {
      const double r = (centre[s] - centre[middle]).norm();
      if (r > 4.0 * radius || normal[s].dot(normal[middle]) < 0.2) continue;
      const std::vector<Index> nodes = side_nodes(body.mesh, sides[s]);
      const ShapeValues share =
          std::exp(-r * r / radius / radius) *
          facet_shape_integrals(traits(body.mesh.element).facet, positions(body.mesh, nodes), 1.0);
      sum += share.sum();
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        for (int axis = 0; axis < 3; ++axis) {
          const std::int64_t dof = stiffness.free_of_dof[static_cast<std::size_t>(3 * nodes[k] + axis)];
          if (dof >= 0)
            f[static_cast<std::size_t>(dof)] -= share[static_cast<Eigen::Index>(k)] * normal[middle][axis];
        }
      }
    }
    const std::vector<double> u = factor.solve(f);
    double work = 0.0;
    for (std::size_t k = 0; k < u.size(); ++k) work += f[k] * u[k] / sum / sum;
    result.push_back(work);
  }
  return result;
}

/// Mean and range over the places of how much stiffer a body is than tet10.
std::string stiffer(const std::vector<double>& right, const std::vector<double>& found) {
  double sum = 0.0, least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (std::size_t k = 0; k < right.size(); ++k) {
    sum += right[k] / found[k];
    least = std::min(least, right[k] / found[k]);
    most = std::max(most, right[k] / found[k]);
  }
  return fmt::format(" {:.3f} ({:.3f} to {:.3f}) |", sum / static_cast<double>(right.size()), least, most);
}

void run(const std::string& file, double radius) {
  const Model model = load_model(file);
  const Body linear = body_of(model, ElementType::tet4), averaged = body_of(model, ElementType::tet4a),
             quadratic = body_of(model, ElementType::tet10);
  const SparseMatrix without_lambda = stiffness_of(averaged, 0.0).K,
                     with_two_mu = stiffness_of(averaged, 2.0 * mu).K;
  const std::vector<double> parts = {0.0, 1.0, 2.0, 4.0, std::numeric_limits<double>::infinity()};
  fmt::print("| ν | tet4 |");
  for (const double part : parts)
    fmt::print("{}", std::isinf(part) ? " all λ |" : fmt::format(" λ up to {} μ |", part));
  fmt::print("\n|---|---|---|---|---|---|---|\n");
  for (const double nu : {0.3, 0.45, 0.49}) {
    const double lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu);
    const std::vector<double> right = works(quadratic, stiffness_of(quadratic, lambda), radius);
    fmt::print("| {} |{}", nu, stiffer(right, works(linear, stiffness_of(linear, lambda), radius)));
    Stiffness body = stiffness_of(averaged, 10.0 * mu);
    const SparseMatrix by_nodes = (body.K - with_two_mu) / (8.0 * mu),
                       by_edges = (with_two_mu - without_lambda) / (2.0 * mu);
    for (const double part : parts) {
      const double of_edges = std::min(lambda, part * mu);
      body.K = without_lambda + of_edges * by_edges + (lambda - of_edges) * by_nodes;
      fmt::print("{}", stiffer(right, works(averaged, body, radius)));
      std::fflush(stdout);
    }
    fmt::print("\n");
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    fmt::print(stderr, "averaged_study FILE [RADIUS]\n");
    return 2;
  }
  try {
    palpate::run(argv[1], argc > 2 ? std::stod(argv[2]) : 0.008);
  } catch (const palpate::Error& error) {
    fmt::print(stderr, "{}: {}\n", error.where(), error.what());
    return 1;
  }
  return 0;
}
