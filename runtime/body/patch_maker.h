// Makes the overlays of a body.
#pragma once

#include <memory>
#include <span>

#include "runtime/body/patch.h"

namespace palpate {

/// How fine overlays are and how far they reach.
struct OverlayOptions {
  int refinement = 3;  ///< r: each element is cut into r^d
  int rings = 2;       ///< of elements round the centres
};

/// Patches round nodes of a body's surface. For one thread at a time.
class PatchMaker {
 public:
  /// For a body whose surface is refined as the overlays will be; it must live as long.
  PatchMaker(const Body& body, int rings);

  /// One patch over the elements within the rings round all centres (stored nodes): where those of several
  /// overlap they are one. Round one centre it is taken from the file where that has it, else condensed.
  /// Throws Error when the elements are too flat, the file keeps too few layers below the surface, or what
  /// the file has is not of this patch.
  [[nodiscard]] std::shared_ptr<const Patch> make(std::span<const Index> centres);

  /// The fine mesh of that patch. Throws Error as `make` does.
  [[nodiscard]] PatchMesh mesh(std::span<const Index> centres);

  /// What the file has of the patch round a stored node, null where it has none as the body's and ours are.
  [[nodiscard]] const CondensedPatch* stored(Index centre) const noexcept;

  /// Stored nodes on the surface that share an element with one.
  [[nodiscard]] std::vector<Index> neighbours(Index centre) const;

 private:
  const Body& body_;
  ElementsAtNodes at_;
  Subdivisions cuts_;
  int rings_;
};

/// Tools that overlays follow; what further ones touch has none of their own.
inline constexpr std::size_t most_overlay_tools = 4;

/// The largest number g of nodes that patches of so many tools can have: give it as
/// StateOptions::patch_nodes. Throws Error when the file keeps too few layers below the surface for one of
/// them.
Index patch_room(const Body& body, int rings, std::size_t tools);

}  // namespace palpate
