// NAFEMS LE10, a thick elliptic plate, from a file of linear tetrahedra made quadratic, held by lists of
// nodes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "meshes/element.h"
#include "meshes/generate.h"
#include "precompute/description/read_description.h"
#include "precompute/numerics/loads.h"
#include "precompute/numerics/meshed_body.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::le10_test {
namespace {

constexpr double E = 210e9, nu = 0.3, thick = 0.6, pressure = 1e6, target = -5.38e6;  // [Pa] at D
constexpr std::array<int, 3> cells = {6, 12, 4};  // across, round, through
constexpr double small = 1e-9;

/// A quarter of the plate, between two ellipses: (across, round, height) in the unit cube to a place.
Vec3 on_plate(const Vec3& unit) {
  const double angle = 0.5 * std::numbers::pi * unit.y();
  const double a = std::lerp(2.0, 3.25, unit.x()), b = std::lerp(1.0, 2.75, unit.x());
  return {a * std::cos(angle), b * std::sin(angle), thick * unit.z()};
}

struct Plate {
  Mesh unit = generate(BoxShape{Vec3::Zero(), Vec3::Ones(), cells});

  [[nodiscard]] std::vector<Index> where(const std::function<bool(const Vec3&)>& inside) const {
    std::vector<Index> nodes;
    for (std::size_t node = 0; node < unit.nodes.size(); ++node)
      if (inside(unit.nodes[node])) nodes.push_back(static_cast<Index>(node));
    return nodes;
  }

  /// Gmsh's text, with the triangles of the outer face tagged 7.
  [[nodiscard]] std::string msh() const {
    std::string text = fmt::format("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", unit.nodes.size());
    for (std::size_t node = 0; node < unit.nodes.size(); ++node) {
      const Vec3 x = on_plate(unit.nodes[node]);
      text += fmt::format("{} {} {} {}\n", node + 1, x.x(), x.y(), x.z());
    }
    const Surface surface = extract_surface(unit);
    std::string elements;
    int count = 0;
    for (Index facet = 0; facet < surface.count(); ++facet) {
      const auto nodes = surface.facet_nodes(facet);
      if (!std::all_of(nodes.begin(), nodes.end(), [&](Index node) {
            return unit.nodes[static_cast<std::size_t>(node)].x() > 1.0 - small;
          }))
        continue;
      elements += fmt::format("{} 2 2 7 7 {} {} {}\n", ++count, nodes[0] + 1, nodes[1] + 1, nodes[2] + 1);
    }
    for (Index e = 0; e < unit.elements(); ++e) {
      const auto nodes = unit.element_nodes(e);
      elements += fmt::format("{} 4 2 1 1 {} {} {} {}\n", ++count, nodes[0] + 1, nodes[1] + 1, nodes[2] + 1,
                              nodes[3] + 1);
    }
    return text + fmt::format("$EndNodes\n$Elements\n{}\n", count) + elements + "$EndElements\n";
  }
};

std::string list(const std::vector<Index>& nodes) {
  return fmt::format("nodes = [{}]\n", fmt::join(nodes, ", "));
}

/// The plate with its outer face held as `outer` says. Its symmetry planes and the middle of the outer face
/// are held by lists of corners too, and so is the loaded face.
std::string model(const Plate& plate, const std::string& outer) {
  const auto entry = [&](const std::string& axes, const std::function<bool(const Vec3&)>& inside) {
    return "[[fixed]]\naxes = \"" + axes + "\"\n" + list(plate.where(inside));
  };
  return fmt::format(
             "name = \"le10\"\n[geometry]\nvolume = \"plate.msh\"\n[mesh]\nelement = \"tet10\"\n"
             "[material]\nyoungs_modulus = {}\npoissons_ratio = {}\n",
             E, nu) +
         entry("x", [](const Vec3& at) { return at.y() > 1.0 - small; }) +
         entry("y", [](const Vec3& at) { return at.y() < small; }) + "[[fixed]]\naxes = \"xy\"\n" + outer +
         entry("z", [](const Vec3& at) { return at.x() > 1.0 - small && std::abs(at.z() - 0.5) < small; }) +
         fmt::format("[[load]]\ntraction = [0, 0, {}]\n", -pressure) +
         list(plate.where([](const Vec3& at) { return at.z() > 1.0 - small; }));
}

std::vector<Vec3> displacement(const Description& description, const MeshedBody& body) {
  std::vector<Material> materials;
  for (const MaterialPart& part : description.materials) materials.push_back(part.material);
  const Stiffness stiffness = assemble_stiffness(
      {body.mesh, Analysis::solid, 1.0, materials, body.material_of_element, body.fixed, body.prescribed});
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  return rest_displacement(factor, stiffness, nodal_loads(description, body), body.prescribed, 3);
}

/// sigma_yy at a node: the mean of D B u over its elements.
double stress_yy(const Mesh& mesh, const std::vector<Vec3>& u, Index node) {
  const ElasticityMatrix D = elasticity_matrix({E, nu, 1000.0}, Analysis::solid);
  double sum = 0.0;
  int count = 0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    const auto nodes = mesh.element_nodes(e);
    const auto found = std::find(nodes.begin(), nodes.end(), node);
    if (found == nodes.end()) continue;
    Eigen::VectorXd u_e(3 * std::ssize(nodes));
    for (std::size_t k = 0; k < nodes.size(); ++k)
      u_e.segment<3>(3 * static_cast<Eigen::Index>(k)) = u[static_cast<std::size_t>(nodes[k])];
    const Vec3 xi = reference_nodes(mesh.element)[static_cast<std::size_t>(found - nodes.begin())];
    const StrainMatrix B =
        strain_matrix(mapped_gradients(mesh.element, element_nodes(mesh, e), xi).gradients);
    sum += Eigen::VectorXd(D * (B * u_e))[1];
    ++count;
  }
  return sum / count;
}

TEST(LE10, HeldByListsOfCorners) {
  const Plate plate;
  const test::ScratchFolder folder;
  static_cast<void>(folder.write("plate.msh", plate.msh()));
  const auto of = [&](const std::string& outer) {
    return read_description(folder.write("model.toml", model(plate, outer)));
  };
  const auto outer = [](const Vec3& at) { return at.x() > 1.0 - small; };
  const Description by_nodes = of(list(plate.where(outer)));
  const MeshedBody body = mesh_body(by_nodes, [](const std::string&) {});
  const MeshedBody by_tag = mesh_body(of("tag = 7\n"), [](const std::string&) {});
  EXPECT_EQ(body.fixed, by_tag.fixed);
  const auto note = std::find_if(body.notes.begin(), body.notes.end(), [](const std::string& text) {
    return text.find("[[fixed]] number 3") != std::string::npos;
  });
  ASSERT_NE(note, body.notes.end());
  EXPECT_TRUE(test::contains(*note, "65 listed nodes")) << *note;  // 13 x 5
  EXPECT_TRUE(test::contains(*note, "160")) << *note;              // 12 x 5 + 13 x 4 and 48 diagonals

  const std::vector<Vec3> u = displacement(by_nodes, body);
  const Vec3 D(2.0, 0.0, thick);
  Index at_D = 0;
  for (std::size_t node = 0; node < body.mesh.nodes.size(); ++node)
    if ((body.mesh.nodes[node] - D).norm() < small) at_D = static_cast<Index>(node);
  EXPECT_NEAR(stress_yy(body.mesh, u, at_D), target, 0.06 * std::abs(target));
}

}  // namespace
}  // namespace palpate::le10_test
