#include "precompute/numerics/overlay_regions.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "base/error.h"
#include "matrices/packed.h"
#include "meshes/selection.h"
#include "overlay/condensation.h"
#include "overlay/patch_mesh.h"

namespace palpate {
namespace {

/// Makes the meshes of patches around one node each. For one thread.
class PatchMeshes {
 public:
  PatchMeshes(const Model& model, const ElementsAtNodes& at, const OverlayRegions& overlay)
      : model_(model), at_(at), cuts_(model.mesh.element, overlay.refinement), rings_(overlay.rings) {}

  PatchMesh round(Index centre) {
    return make_patch_mesh(model_, at_, cuts_, rings_round(model_.mesh, at_, {&centre, 1}, rings_));
  }

 private:
  const Model& model_;
  const ElementsAtNodes& at_;
  Subdivisions cuts_;
  int rings_;
};

std::vector<Index> centres_in(const Model& model, const OverlayRegions& overlay, const std::string& file) {
  const int all_axes = (1 << model.dimension()) - 1;
  std::vector<std::uint8_t> touched(model.mesh.nodes.size(), 0);
  for (const Index node : model.surface) {
    const auto i = static_cast<std::size_t>(node);
    touched[i] = model.fixed[i] == all_axes ? 0 : 1;
  }
  std::vector<Index> centres;
  for (std::size_t entry = 0; entry < overlay.regions.size(); ++entry) {
    const std::string where = fmt::format("{}: [[overlay.region]] number {}", file, entry + 1);
    const std::vector<std::uint8_t> selected = select_nodes(model.mesh, overlay.regions[entry], where);
    const std::size_t before = centres.size();
    for (std::size_t node = 0; node < selected.size(); ++node) {
      if (selected[node] != 0 && touched[node] != 0) centres.push_back(static_cast<Index>(node));
    }
    if (centres.size() == before)
      throw Error("the selection holds no node of the surface that can move", where,
                  "select nodes that a tool can touch, in metres");
  }
  std::sort(centres.begin(), centres.end());
  centres.erase(std::unique(centres.begin(), centres.end()), centres.end());
  return centres;
}

}  // namespace

OverlayPlan plan_overlays(const Model& model, const OverlayRegions& overlay, const std::string& file) {
  check_for_overlays(model, file + ": [overlay]");
  OverlayPlan plan;
  plan.centres = centres_in(model, overlay, file);
  const ElementsAtNodes at(model.mesh);
  PatchMeshes meshes(model, at, overlay);
  constexpr auto scalar = static_cast<std::int64_t>(sizeof(double));
  for (const Index centre : plan.centres) {
    const PatchMesh mesh = meshes.round(centre);
    const std::int64_t m = model.dimension() * std::ssize(surface_nodes(mesh)),
                       g = model.dimension() * std::ssize(mesh.nodes);
    plan.file_bytes += scalar * (packed_size(g) + m * g + packed_size(m));
    plan.memory_bytes += scalar * (g * g + m * g + m * m + packed_size(m));  // all, and a field's copy
  }
  return plan;
}

StoredOverlay condense_overlays(const Model& model, const OverlayRegions& overlay,
                                const std::vector<Index>& centres, Sharing& sharing,
                                const std::function<bool(double)>& done) {
  StoredOverlay result{overlay.refinement, overlay.rings, centres,
                       std::vector<CondensedPatch>(centres.size())};
  const ElementsAtNodes at(model.mesh);
  std::vector<std::optional<PatchMeshes>> meshes(static_cast<std::size_t>(sharing.jobs()));
  SharedItems patches;
  patches.count = std::ssize(centres);
  patches.work = [&](std::int64_t item, int worker) {
    const auto k = static_cast<std::size_t>(item);
    std::optional<PatchMeshes>& own = meshes[static_cast<std::size_t>(worker)];
    if (!own) own.emplace(model, at, overlay);
    result.patches[k] = condense(model, own->round(centres[k]));
  };
  patches.carry = [&](std::int64_t item, Parcel& results) {
    CondensedPatch& patch = result.patches[static_cast<std::size_t>(item)];
    results.carry(patch.surface);
    for (Eigen::MatrixXd* matrix : {&patch.G, &patch.T, &patch.compliance}) results.carry(*matrix);
  };
  patches.done = done;
  sharing.for_each(patches);
  return result;
}

}  // namespace palpate
