// Nodes whose displacement is prescribed: the papers' contact.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/body/overlay.h"
#include "runtime/solve/capacitance.h"

namespace palpate {

/// What a call could not do.
enum class PrescribedStatus : std::uint8_t {
  ok,
  no_such_node,           ///< not a stored node, or not a held one
  full,                   ///< `max_nodes` are held already
  not_positive_definite,  ///< the node cannot be held beside those that are
  result_not_finite,      ///< the forces overflowed: those before stand
};

/// Stored nodes that are held at a prescribed displacement, and the forces that this takes (theory.md section
/// 3). Copies are complete and independent. All memory is taken at construction. Vectors are those by
/// contact, relative to rest; d numbers a node, d = dimension(), where they are not vectors in space (z = 0
/// in the plane).
class PrescribedNodes {
 public:
  /// Holds nothing; room for `max_nodes`. Throws Error unless that is at least one. With an overlay, which
  /// must live as long, the body is the finer one: then `hold` and `displace` take memory.
  explicit PrescribedNodes(const Body& body, Index max_nodes = 256, const Overlay* overlay = nullptr);

  [[nodiscard]] int dimension() const noexcept { return capacitance_.dimension(); }  ///< d, dofs a node
  [[nodiscard]] Index count() const noexcept { return capacitance_.nodes(); }  ///< m, number of held nodes
  [[nodiscard]] std::span<const Index> nodes() const noexcept;          ///< [m] in the order they were taken
  [[nodiscard]] std::span<const double> displacement() const noexcept;  ///< [dm] prescribed [m]
  [[nodiscard]] std::span<const double> forces() const noexcept;        ///< [dm] on the body there [N]

  /// Takes hold of a stored node where it is now, so that no force changes. A node that is held stays so
  /// (ok).
  PrescribedStatus hold(const Body& body, Index node) noexcept;

  /// Lets go of a stored node. The other forces are out of date until `solve`.
  PrescribedStatus release(Index node) noexcept;

  /// Lets go of all nodes.
  void release_all() noexcept { capacitance_.clear(); }

  /// Prescribes the displacement [m] of a held node, relative to rest; z is ignored in the plane. Forces are
  /// out of date until `solve`.
  PrescribedStatus prescribe(Index node, const Vec3& displacement) noexcept;

  /// f = C^-1 u: the forces on the body that give the held nodes their prescribed displacement (theory.md
  /// section 3).
  PrescribedStatus solve() noexcept;

  /// Position of a stored node among the held ones, -1 when it is not held.
  [[nodiscard]] Index position_of(Index node) const noexcept;

  /// u = Xi E f: displacement u [n] of all stored nodes [m] by the present forces, relative to rest
  /// (theory.md section 3). What is seen is node + u0 + u.
  void displace(const Body& body, std::span<double> u) const noexcept;

 private:
  CapacitanceMatrix capacitance_;
  const Overlay* overlay_;
  std::vector<Index> nodes_;
  std::vector<double> displacement_;
  std::vector<double> force_;
  std::vector<double>
      work_;  // [d d max_nodes] a block row of C, or the force before it is known to be finite
};

}  // namespace palpate
