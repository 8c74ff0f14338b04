#include "runtime/body/patch_maker.h"

#include <algorithm>
#include <string>
#include <vector>

#include "base/error.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

/// True if sizes and surface nodes are those of this mesh.
bool fits(const CondensedPatch& condensed, const PatchMesh& mesh, int dimension) {
  const std::vector<Index> surface = surface_nodes(mesh);
  const Eigen::Index g = dimension * std::ssize(mesh.nodes), m = dimension * std::ssize(surface);
  return condensed.surface == surface && condensed.G.rows() == g && condensed.G.cols() == g &&
         condensed.T.rows() == m && condensed.T.cols() == g && condensed.compliance.rows() == m &&
         condensed.compliance.cols() == m;
}

}  // namespace

Index patch_room(const Body& body, int rings, std::size_t tools) {
  const Model& model = body.model();
  const ElementsAtNodes at(model.mesh);
  const unsigned all_axes = (1U << model.dimension()) - 1U;
  Index most = 0;
  std::vector<std::vector<Index>> centres;
  if (body.rounding() != nullptr) {
    for (const ElementSide& side : boundary_sides(model.mesh))
      centres.push_back(side_nodes(model.mesh, side));
  } else {
    for (const Index stored : body.surface_stored_nodes()) {
      if (stored >= 0) centres.push_back({body.mesh_node(stored)});
    }
  }
  for (const std::vector<Index>& centre : centres) {
    Index count = 0;
    for (const Index node : nodes_of(model.mesh, rings_round(model.mesh, at, centre, rings))) {
      if ((model.fixed[node] & all_axes) == all_axes) continue;
      ++count;
      if (body.stored_node(node) >= 0) continue;
      throw Error("an overlay of " + std::to_string(rings) + " rings reaches node " + std::to_string(node) +
                      ", whose Green's functions are not stored",
                  model.name,
                  "precompute with [storage] scope = \"layers\" and layers = " + std::to_string(rings) +
                      ", or take fewer rings");
    }
    most = std::max(most, count);
  }
  return most * static_cast<Index>(std::min(tools, most_overlay_tools));
}

PatchMaker::PatchMaker(const Body& body, int rings, double finest)
    : body_(body),
      at_(body.model().mesh),
      cuts_(body.model().mesh.element, body.refinement()),
      rings_(rings),
      finest_(finest) {}

PatchMesh PatchMaker::mesh(std::span<const Index> centres) {
  const Model& model = body_.model();
  std::vector<Index> nodes;
  for (const Index centre : centres) nodes.push_back(body_.mesh_node(centre));
  return make_patch_mesh(model, at_, cuts_, rings_round(model.mesh, at_, nodes, rings_));
}

std::shared_ptr<const Patch> PatchMaker::make(std::span<const Index> centres) {
  const Model& model = body_.model();
  if (is_graded()) {
    const GradedMesh mesh = graded(centres);
    return make_patch(body_, mesh, condense(model, mesh.mesh, work_));
  }
  const PatchMesh mesh = this->mesh(centres);
  const CondensedPatch* ready = centres.size() == 1 ? stored(centres[0]) : nullptr;
  if (ready == nullptr) return make_patch(body_, mesh, condense(model, mesh, work_));
  if (!fits(*ready, mesh, body_.dimension())) {
    throw Error("the overlay that is stored for node " + std::to_string(body_.mesh_node(centres[0])) +
                    " does not belong to the fine mesh there",
                model.name, "precompute it again");
  }
  return make_patch(body_, mesh, *ready);
}

GradedMesh PatchMaker::graded(std::span<const Index> centres) const {
  const Model& model = body_.model();
  PatchFocus focus{.points = {}, .edge = finest_};
  std::vector<Index> nodes;
  for (const Index centre : centres) {
    focus.points.push_back(body_.flat_position(centre));
    for (const Index corner : body_.fine_surface().corners[static_cast<std::size_t>(centre)]) {
      if (corner >= 0) nodes.push_back(corner);
    }
  }
  return make_graded_mesh(model, at_, *body_.rounding(), rings_round(model.mesh, at_, nodes, 1), focus);
}

const CondensedPatch* PatchMaker::stored(Index centre) const noexcept {
  const StoredOverlay& overlay = body_.model().overlay;
  if (is_graded() || overlay.refinement != body_.refinement() || overlay.rings != rings_) return nullptr;
  const Index node = body_.mesh_node(centre);
  const auto found = std::lower_bound(overlay.centres.begin(), overlay.centres.end(), node);
  if (found == overlay.centres.end() || *found != node) return nullptr;
  return &overlay.patches[found - overlay.centres.begin()];
}

std::vector<Index> PatchMaker::neighbours(Index centre) const {
  if (is_graded()) return {};
  const Mesh& mesh = body_.model().mesh;
  const auto around = at_[body_.mesh_node(centre)];
  std::vector<Index> found;
  for (const Index node : nodes_of(mesh, {around.begin(), around.end()})) {
    const Index stored = body_.stored_node(node);
    if (stored >= 0 && stored != centre && body_.surface_node_of_stored(stored) >= 0) found.push_back(stored);
  }
  return found;
}

}  // namespace palpate
