// Factory of a body's overlays.
#pragma once

#include <memory>
#include <span>

#include "runtime/body/make_patch.h"

namespace palpate {

/// Means by which a body is finer under the tools than its mesh.
enum class OverlayKind : std::uint8_t {
  none,    ///< nothing
  local,   ///< no mesh: LocalCompliance, on a rounded surface, if the body's mesh is too coarse for the tools
  graded,  ///< besides, where they are ready, meshes graded by the tools' radii (PatchMaker)
  uniform  ///< elements cut alike
};

/// Refinement and reach of overlays.
struct OverlayOptions {
  OverlayKind kind = OverlayKind::local;
  int refinement = 3;  ///< r: each element is divided into r^d, if uniform
  int rings = 2;       ///< rings of elements around the centres

  [[nodiscard]] bool has_patches() const noexcept { return kind >= OverlayKind::graded; }
};

/// Makes patches around nodes of a body's surface. For one thread at a time.
///
/// Those of a rounded body are graded: finest at the centres, which are then surface nodes, and over the
/// elements round the body's nodes that these follow.
class PatchMaker {
 public:
  /// For a body whose surface is refined like the overlays; it must outlive this. `finest`: longest edge of
  /// graded patches at their centres [m].
  PatchMaker(const Body& body, int rings, double finest = 0.0);

  [[nodiscard]] bool is_graded() const noexcept { return body_.rounding() != nullptr; }

  /// Makes one patch over the elements within the rings around all centres (stored nodes); overlapping
  /// regions are merged. For a single centre it is taken from the file if available, otherwise condensed.
  /// Throws Error if the elements are too flat, the file has too few layers below the surface, or the file's
  /// data do not fit this patch.
  [[nodiscard]] std::shared_ptr<const Patch> make(std::span<const Index> centres);

  /// Returns the fine mesh of that patch. Throws Error as `make` does.
  [[nodiscard]] PatchMesh mesh(std::span<const Index> centres);

  /// Returns the file's data of the patch around a stored node; null if there are none with this refinement
  /// and number of rings.
  [[nodiscard]] const CondensedPatch* stored(Index centre) const noexcept;

  /// Stored surface nodes that have an element in common with `centre`.
  [[nodiscard]] std::vector<Index> neighbours(Index centre) const;

 private:
  const Body& body_;
  [[nodiscard]] GradedMesh graded(std::span<const Index> centres) const;

  ElementsAtNodes at_;
  Subdivisions cuts_;
  int rings_;
  double finest_;
  CondensationMemory work_;
};

/// The number by which a recording names the centre of a patch: a mesh node, of a rounded body a surface
/// node.
[[nodiscard]] inline Index recorded_centre(const Body& body, Index centre) noexcept {
  return body.rounding() != nullptr ? centre : body.mesh_node(centre);
}
/// The centre of that number; -1 if no patch can lie round it.
[[nodiscard]] inline Index centre_of_record(const Body& body, Index number) noexcept {
  const std::size_t count =
      body.rounding() != nullptr ? body.surface_rest_positions().size() : body.model().mesh.nodes.size();
  if (number < 0 || static_cast<std::size_t>(number) >= count) return -1;
  if (body.rounding() != nullptr) return number;
  const Index stored = body.stored_node(number);
  return stored >= 0 && body.surface_node_of_stored(stored) >= 0 ? stored : -1;
}

/// Number of tools that overlays follow; further tools have none of their own.
inline constexpr std::size_t most_overlay_tools = 4;

/// Returns the largest number g of nodes in patches for this number of tools, to be given as
/// StateOptions::patch_nodes. Throws Error if the file has too few layers below the surface for one of them.
Index patch_room(const Body& body, int rings, std::size_t tools);

}  // namespace palpate
