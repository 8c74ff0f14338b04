#include "runtime/app/probe_field.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "base/vectors.h"
#include "base/write_file.h"
#include "meshes/readers/vtu_writer.h"
#include "runtime/background/surface_stress.h"
#include "runtime/body/surface_numbering.h"

namespace palpate {
namespace {

/// Node of the body or of an overlay's fine mesh.
struct FieldNode {
  Index node;  // body node, -1 if there is none
  Vec3 x;      // position in the mesh [m]
  Vec3 u0;     // displacement at rest [m]
  Vec3 u;      // displacement from rest by the probe [m]
  Stress stress = Stress::Constant(std::numeric_limits<double>::quiet_NaN());
};

/// Displacement and stress of a probed body.
struct Probed {
  const Body& body;
  std::span<const double> u;            // [n]
  std::map<Index, Stress> stress = {};  // per mesh node

  [[nodiscard]] FieldNode node(Index node) const {
    const Model& model = body.model();
    const auto at = static_cast<std::size_t>(node);
    const Index stored = body.stored_node(node);
    FieldNode result{node, model.mesh.nodes[at], model.rest_displacement[at],
                     stored < 0 ? Vec3(Vec3::Zero()) : vector_at(u, body.dimension(), stored)};
    if (const auto found = stress.find(node); found != stress.end()) result.stress = found->second;
    return result;
  }

  /// Computes the stress on the surface from its displacement and the forces [n] on it [N].
  void find_stress(std::span<const double> force) {
    const std::span<const Index> nodes = body.surface_mesh_nodes();
    std::vector<Vec3> moved, pushed;
    for (const Index node : nodes) {
      const FieldNode at = this->node(node);
      const Index stored = body.stored_node(node);
      moved.push_back(at.u0 + at.u);
      pushed.push_back(stored < 0 ? Vec3(Vec3::Zero()) : vector_at(force, body.dimension(), stored));
    }
    std::vector<Stress> found(nodes.size());
    SurfaceStress(body).evaluate(moved, pushed, nullptr, found);
    for (std::size_t k = 0; k < nodes.size(); ++k) stress.emplace(nodes[k], found[k]);
  }
};

/// Returns the nodes of the fine mesh, including those of the body: u = u_G + u_L.
std::vector<FieldNode> fine_nodes(const Body& body, const Overlay& overlay, std::span<const double> u) {
  const PatchMesh& patch = overlay.patch();
  const auto d = static_cast<std::size_t>(body.dimension());
  std::vector<double> at_nodes;
  for (const Index stored : overlay.stored_nodes()) {
    const auto node = u.subspan(d * static_cast<std::size_t>(stored), d);
    at_nodes.insert(at_nodes.end(), node.begin(), node.end());
  }
  const Eigen::Map<const Eigen::VectorXd> u_Q(at_nodes.data(), std::ssize(at_nodes));
  const auto by_axis = u_Q.reshaped(body.dimension(), patch.shape.cols());
  Eigen::MatrixXd total = (patch.shape * by_axis.transpose()).transpose();
  const Eigen::VectorXd u_L = overlay.local_displacement(u_Q);
  for (std::size_t dof = 0; dof < patch.free_dof.size(); ++dof) {
    if (patch.free_dof[dof] >= 0) total.data()[dof] += u_L[patch.free_dof[dof]];
  }
  const std::span<const double> values(total.data(), static_cast<std::size_t>(total.size()));
  std::vector<FieldNode> nodes;
  for (std::size_t k = 0; k < patch.local.nodes.size(); ++k) {
    nodes.push_back({patch.body_node[k], patch.local.nodes[k], patch.rest_displacement[k],
                     vector_at(values, body.dimension(), static_cast<Index>(k))});
  }
  return nodes;
}

/// Writes a row per stored node, then a row per node of the fine mesh alone.
void write_csv(const std::filesystem::path& file, const Probed& probed, const Overlay* overlay) {
  const Body& body = probed.body;
  std::string csv = "node,x,y,z,u0x,u0y,u0z,ux,uy,uz,sxx,syy,szz,sxy,syz,szx,von_mises\n";
  const auto add = [&csv](const FieldNode& at) {
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", at.node, at.x.x(), at.x.y(), at.x.z(),
                       at.u0.x(), at.u0.y(), at.u0.z(), at.u.x(), at.u.y(), at.u.z(),
                       fmt::join(at.stress, ","), von_mises(at.stress));
  };
  for (Index stored = 0; stored < body.greens().nodes(); ++stored) add(probed.node(body.mesh_node(stored)));
  if (overlay != nullptr) {
    for (const FieldNode& node : fine_nodes(body, *overlay, probed.u)) {
      if (node.node < 0) add(node);
    }
  }
  write_file(file, csv);
}

/// Elements of one kind.
struct Cells {
  ElementType element;
  std::vector<Index> connectivity;
};

/// Replaces the cells of the patch's elements by those of the fine mesh. Nodes of the fine mesh alone are
/// numbered after the body's.
void lay_over(Cells& cells, const Body& body, const PatchMesh& patch) {
  const Mesh& mesh = body.model().mesh;
  const bool whole = cells.element == mesh.element;
  std::vector<Index> element_of_cell(static_cast<std::size_t>(mesh.elements()));
  std::iota(element_of_cell.begin(), element_of_cell.end(), 0);
  if (!whole) element_of_cell = surface_elements(body.model());
  const auto width = static_cast<std::size_t>(traits(cells.element).nodes);
  std::vector<Index> result;
  for (std::size_t cell = 0; cell < element_of_cell.size(); ++cell) {
    if (std::binary_search(patch.elements.begin(), patch.elements.end(), element_of_cell[cell])) continue;
    const auto nodes = std::span(cells.connectivity).subspan(width * cell, width);
    result.insert(result.end(), nodes.begin(), nodes.end());
  }
  for (const Index node : whole ? patch.local.connectivity : patch.surface) {
    const Index same = patch.body_node[static_cast<std::size_t>(node)];
    result.push_back(same >= 0 ? same : static_cast<Index>(mesh.nodes.size()) + node);
  }
  cells.connectivity = std::move(result);
}

/// Returns the whole mesh if all its nodes are stored or held, otherwise its surface.
Cells shown_cells(const Body& body) {
  const Model& model = body.model();
  bool whole = true;
  for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node) {
    whole = whole && (body.stored_node(static_cast<Index>(node)) >= 0 || model.fixed[node] != 0);
  }
  if (whole) return {model.mesh.element, model.mesh.connectivity};
  return {body.dimension() == 3 ? ElementType::tri3 : ElementType::line2, model.surface};
}

/// Drops the nodes without a cell; returns the remaining ones.
std::vector<std::size_t> keep_used_nodes(Cells& cells, std::size_t nodes) {
  std::vector<Index> number(nodes, -1);
  for (const Index node : cells.connectivity) number[static_cast<std::size_t>(node)] = 0;
  std::vector<std::size_t> kept;
  for (std::size_t node = 0; node < nodes; ++node) {
    if (number[node] < 0) continue;
    number[node] = static_cast<Index>(kept.size());
    kept.push_back(node);
  }
  for (Index& node : cells.connectivity) node = number[static_cast<std::size_t>(node)];
  return kept;
}

/// Writes a grid of the undeformed body with u0 and the visible displacement u0 + u. Nodes that are not
/// stored are held along every axis and shown at rest.
void write_grid(const std::filesystem::path& file, const Probed& probed, const Overlay* overlay) {
  const Body& body = probed.body;
  const auto body_nodes = static_cast<Index>(body.model().mesh.nodes.size());
  std::vector<FieldNode> all;
  all.reserve(body.model().mesh.nodes.size());
  for (Index node = 0; node < body_nodes; ++node) all.push_back(probed.node(node));
  Cells cells = shown_cells(body);
  if (overlay != nullptr) {
    lay_over(cells, body, overlay->patch());
    const std::vector<FieldNode> fine = fine_nodes(body, *overlay, probed.u);
    all.insert(all.end(), fine.begin(), fine.end());
  }
  std::vector<Vec3> nodes;
  std::vector<double> rest, total, stress, equivalent;
  for (const std::size_t k : keep_used_nodes(cells, all.size())) {
    nodes.push_back(all[k].x);
    const Vec3 seen = all[k].u0 + all[k].u;
    rest.insert(rest.end(), all[k].u0.begin(), all[k].u0.end());
    total.insert(total.end(), seen.begin(), seen.end());
    stress.insert(stress.end(), all[k].stress.begin(), all[k].stress.end());
    equivalent.push_back(von_mises(all[k].stress));
  }
  const std::vector<NodalField> fields = {{"displacement", 3, total},
                                          {"rest_displacement", 3, rest},
                                          {"stress", 6, stress},
                                          {"von_mises", 1, equivalent}};
  write_vtu(file, nodes, cells.element, cells.connectivity, fields);
}

}  // namespace

void write_field(const std::filesystem::path& file, const Body& body, const Overlay* overlay,
                 std::span<const double> u, std::span<const double> force) {
  Probed probed{body, u};
  if (overlay == nullptr) probed.find_stress(force);
  if (file.extension() == ".csv") {
    write_csv(file, probed, overlay);
  } else {
    write_grid(file, probed, overlay);
  }
}

}  // namespace palpate
