// Nodes with prescribed displacement: the contact of the papers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/body/overlay.h"
#include "runtime/core/solve/capacitance.h"

namespace palpate {

/// Result of a call.
enum class PrescribedStatus : std::uint8_t {
  ok,
  no_such_node,           ///< not a stored node, or not a held one
  full,                   ///< `max_nodes` are held already
  not_positive_definite,  ///< the node cannot be held beside the others
  result_not_finite,      ///< the forces overflowed: the previous ones are kept
};

/// Stored nodes held at a prescribed displacement, and the forces that this requires (theory.md section 3).
/// Copies are complete and independent. All memory is allocated at construction. Vectors are displacements by
/// contact, relative to rest; arrays have d = dimension() numbers per node, other vectors are in space (z = 0
/// in the plane).
class PrescribedNodes {
 public:
  /// Holds no node, with a capacity of `max_nodes`. Throws Error unless that is at least one. With an
  /// overlay, which must outlive this, the body is the finer one; `hold` and `displace` then allocate.
  explicit PrescribedNodes(const Body& body, Index max_nodes = 256, const Overlay* overlay = nullptr);

  [[nodiscard]] int dimension() const noexcept { return capacitance_.dimension(); }  ///< d, dofs per node
  [[nodiscard]] Index count() const noexcept { return capacitance_.nodes(); }  ///< m, number of held nodes
  [[nodiscard]] std::span<const Index> nodes() const noexcept;                 ///< [m] in the order of `hold`
  [[nodiscard]] std::span<const double> displacement() const noexcept;         ///< [dm] prescribed [m]
  [[nodiscard]] std::span<const double> forces() const noexcept;               ///< [dm] on the body there [N]

  /// Holds a stored node at its present position, so that no force changes. If it is held already, nothing
  /// changes (ok).
  PrescribedStatus hold(const Body& body, Index node) noexcept;

  /// Releases a stored node. The other forces are out of date until `solve`.
  PrescribedStatus release(Index node) noexcept;

  /// Releases all nodes.
  void release_all() noexcept { capacitance_.clear(); }

  /// Prescribes the displacement [m] of a held node, relative to rest; z is ignored in the plane. Forces are
  /// out of date until `solve`.
  PrescribedStatus prescribe(Index node, const Vec3& displacement) noexcept;

  /// f = C^-1 u: computes the forces on the body that give the held nodes their prescribed displacement
  /// (theory.md section 3).
  PrescribedStatus solve() noexcept;

  /// Index of a stored node among the held ones; -1 if it is not held.
  [[nodiscard]] Index position_of(Index node) const noexcept;

  /// u = Xi E f: computes the displacement u [n] of all stored nodes [m] by the present forces, relative to
  /// rest (theory.md section 3). The visible position is node + u0 + u.
  void displace(const Body& body, std::span<double> u) const noexcept;

 private:
  CapacitanceMatrix capacitance_;
  const Overlay* overlay_;
  std::vector<Index> nodes_;
  std::vector<double> displacement_;
  std::vector<double> force_;
  std::vector<double> work_;  // [d d max_nodes] a block row of C, or the force until it is known to be finite
};

}  // namespace palpate
