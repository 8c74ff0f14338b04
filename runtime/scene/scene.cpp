#include "runtime/scene/scene.h"

#include <algorithm>

#include "meshes/surface.h"
#include "meshes/topology.h"
#include "runtime/body/surface_numbering.h"
#include "runtime/scene/inner_surface.h"
#include "runtime/scene/node_order.h"

namespace palpate {
namespace {

using Line = std::array<Index, 2>;

Line undirected(Index a, Index b) {
  return {std::min(a, b), std::max(a, b)};
}

/// Removes duplicates.
std::vector<Line> unique(std::vector<Line> lines) {
  std::sort(lines.begin(), lines.end());
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  return lines;
}

/// Appends the edges of an element or a facet; a curved edge becomes two segments.
void add_edges(ElementType type, std::span<const Index> nodes, std::vector<Line>& edges) {
  std::size_t middle = type == ElementType::tri6 ? static_cast<std::size_t>(traits(type).corners) : 0;
  for (const EdgeNodes& edge : element_edges(type)) {
    const Index a = nodes[edge[0]];
    const Index b = nodes[edge[1]];
    if (middle == 0) {
      edges.push_back(undirected(a, b));
    } else {
      edges.push_back(undirected(a, nodes[middle]));
      edges.push_back(undirected(nodes[middle], b));
      ++middle;
    }
  }
}

template <std::size_t corners>
std::vector<std::array<Index, corners>> grouped(std::span<const Index> numbers) {
  std::vector<std::array<Index, corners>> groups(numbers.size() / corners);
  for (std::size_t k = 0; k < groups.size(); ++k)
    std::copy_n(numbers.begin() + static_cast<std::ptrdiff_t>(corners * k), corners, groups[k].begin());
  return groups;
}

std::vector<Line> edges_of(std::span<const std::array<Index, 3>> triangles) {
  std::vector<Line> edges;
  for (const std::array<Index, 3>& t : triangles) add_edges(ElementType::tri3, t, edges);
  return edges;
}

bool all_free_nodes_stored(const Body& body) {
  const Model& model = body.model();
  const auto all_axes = static_cast<std::uint8_t>((1U << model.dimension()) - 1U);
  for (std::size_t node = 0; node < model.fixed.size(); ++node) {
    if ((model.fixed[node] & all_axes) != all_axes && body.stored_node(static_cast<Index>(node)) < 0)
      return false;
  }
  return true;
}

void fill_plane(const Model& model, Scene& scene) {
  scene.is_plane = true;
  scene.nodes = model.mesh.nodes;
  scene.held = model.fixed;
  std::vector<Line> edges;
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const auto nodes = model.mesh.element_nodes(e);
    for (std::size_t k = 2; k < nodes.size(); ++k) {
      scene.triangles.push_back({nodes[0], nodes[k - 1], nodes[k]});
      scene.elements.push_back(e);
    }
    add_edges(model.mesh.element, nodes, edges);
  }
  scene.edges = unique(std::move(edges));
}

void fill_surface(const Body& body, Scene& scene) {
  const Model& model = body.model();
  for (const Index node : body.surface_mesh_nodes()) {
    scene.nodes.push_back(model.mesh.nodes[static_cast<std::size_t>(node)]);
    scene.held.push_back(model.fixed[static_cast<std::size_t>(node)]);
  }
  const std::vector<Index> simplices = number_surface(model.surface, model.mesh.nodes.size()).simplices;
  if (model.dimension() == 2) {
    scene.edges = grouped<2>(simplices);
    return;
  }
  scene.triangles = grouped<3>(simplices);
  scene.elements = surface_elements(model);
  if (model.materials.size() > 1) {
    for (const Index e : scene.elements) scene.materials.push_back(material_number(model, e));
    scene.inner = make_inner_surface(model);
  }
  const Surface surface = extract_surface(model.mesh);
  std::vector<Line> edges;
  for (Index f = 0; f < surface.count(); ++f) {
    std::vector<Index> nodes;
    for (const Index node : surface.facet_nodes(f)) {
      const auto of_body = body.surface_mesh_nodes();
      const auto place = std::lower_bound(of_body.begin(), of_body.end(), node);
      if (place != of_body.end() && *place == node)
        nodes.push_back(static_cast<Index>(place - of_body.begin()));
    }
    if (std::ssize(nodes) == traits(surface.facet).nodes) add_edges(surface.facet, nodes, edges);
  }
  scene.edges = unique(std::move(edges));
}

/// Returns the edges that belong to one triangle only.
std::vector<Line> outline_of(std::span<const std::array<Index, 3>> triangles) {
  std::vector<Line> edges = edges_of(triangles);
  std::sort(edges.begin(), edges.end());
  std::vector<Line> outline;
  for (auto edge = edges.begin(); edge != edges.end();) {
    const auto end = std::upper_bound(edge, edges.end(), *edge);
    if (end - edge == 1) outline.push_back(*edge);
    edge = end;
  }
  return outline;
}

}  // namespace

Scene make_scene(const Body& body, std::uint32_t number) {
  Scene scene;
  scene.number = number;
  scene.dimension = body.dimension();
  if (body.dimension() == 2 && all_free_nodes_stored(body)) {
    fill_plane(body.model(), scene);
    scene.surface_nodes.assign(body.surface_mesh_nodes().begin(), body.surface_mesh_nodes().end());
  } else {
    fill_surface(body, scene);
  }
  scene.order = order_along_curve(scene.nodes);
  return scene;
}

Scene make_plane_scene(const Model& model, std::uint32_t number) {
  Scene scene;
  scene.number = number;
  scene.dimension = 2;
  fill_plane(model, scene);
  scene.order = order_along_curve(scene.nodes);
  return scene;
}

ScenePatch make_scene_patch(const Body& body, const Scene& scene, const Patch& patch) {
  ScenePatch drawn;
  const std::span<const Index> nodes = patch.surface_nodes();
  drawn.surface_nodes.assign(nodes.begin(), nodes.end());
  const std::vector<Vec3> positions = body.surface_in_mesh();
  for (const Index node : nodes) drawn.nodes.push_back(positions[static_cast<std::size_t>(node)]);

  const auto refined = [&](Index element) {
    return std::binary_search(patch.elements().begin(), patch.elements().end(), element);
  };
  const FineSurface& fine = body.fine_surface();
  const auto d = static_cast<std::size_t>(body.dimension());
  std::vector<Index> simplices;  // in the patch's numbering
  const bool has_materials = !scene.materials.empty();
  for (std::size_t s = 0; s < fine.element.size(); ++s) {
    if (!refined(fine.element[s])) continue;
    if (has_materials) drawn.materials.push_back(material_number(body.model(), fine.element[s]));
    for (const Index node : body.simplices().subspan(d * s, d))
      simplices.push_back(
          static_cast<Index>(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin()));
  }
  if (d == 2) {
    drawn.outline = grouped<2>(simplices);
    return drawn;
  }
  for (std::size_t t = 0; t < scene.elements.size(); ++t) {
    if (refined(scene.elements[t])) drawn.hidden.push_back(static_cast<Index>(t));
  }
  drawn.triangles = grouped<3>(simplices);
  drawn.outline = outline_of(drawn.triangles);
  return drawn;
}

bool fits(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch) {
  const std::vector<float>& of_scene =
      scene.is_plane ? picture.plane_displacement : picture.frame.displacement;
  if (of_scene.size() < 3 * scene.nodes.size()) return false;
  return patch == nullptr || patch->surface_nodes.empty() ||
         picture.frame.displacement.size() >= 3 * (static_cast<std::size_t>(patch->surface_nodes.back()) + 1);
}

Scene make_scene(const RecordedSurface& surface, std::uint32_t number) {
  Scene scene;
  scene.number = number;
  scene.dimension = surface.corners;
  scene.nodes = surface.nodes;
  scene.held = surface.held;
  scene.held.resize(surface.nodes.size());
  if (surface.corners == 2) {
    scene.edges = grouped<2>(surface.simplices);
  } else {
    scene.triangles = grouped<3>(surface.simplices);
    scene.edges = unique(edges_of(scene.triangles));
  }
  scene.order = order_along_curve(scene.nodes);
  return scene;
}

}  // namespace palpate
