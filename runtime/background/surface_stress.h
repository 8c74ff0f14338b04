// Stress on the surface of a body of which only the surface displacement is known.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "meshes/element.h"
#include "runtime/background/side_tractions.h"
#include "runtime/background/stress_rows.h"
#include "runtime/body/body.h"
#include "runtime/core/body/patch.h"

namespace palpate {

/// True if parts of the body rotate, so that strain is small only in local frames.
bool parts_turn(const Body& body) noexcept;

/// Computes the stress on the surface. The surface displacement gives the in-plane strain as in the elements,
/// and the forces give the traction t = sigma n; the other components follow from the material's D. With the
/// in-plane strain e, P = I - n n^T and sigma_0 = D eps_0,
///   sigma = lambda' (tr e) P + 2 mu e - P sigma_0 P + r (n . (t + sigma_0 n)) P
///           + n t^T + t n^T - (n . t) n n^T,
///   lambda' = 2 lambda mu / (lambda + 2 mu), r = lambda / (lambda + 2 mu).
/// It is evaluated at the nodes of each facet and averaged there with the facets' areas as weights; a facet's
/// stress depends on the facet alone, not on the volume behind it. At edges each facet has the traction of
/// its own side (SideTractions), so that a uniform stress is found exactly there too. Small strain: normals
/// and areas are those of the mesh. For a body whose parts rotate (on two levels, or live with any but the
/// linear law) the stress and forces of a node are in the frame rotated with the facets around it; von Mises
/// stress is the same in any frame. Facets whose nodes are all held along some axis have an unknown traction
/// and do not count. The weight of the body is not a traction: it is treated like the weight carried by
/// interior nodes.
class SurfaceStress {
 public:
  /// `body` must outlive this.
  explicit SurfaceStress(const Body& body);
  SurfaceStress(const SurfaceStress&) = delete;
  SurfaceStress& operator=(const SurfaceStress&) = delete;

  /// [S] area over which the contact force of a surface node is distributed [m^2].
  [[nodiscard]] std::span<const double> areas() const noexcept { return area_; }

  /// Computes the stress [S] from u0 + u of all surface nodes [m] and the contact forces on them [N]; loads
  /// are included already. NaN where a node has no facet that counts. With an overlay: on its fine surface
  /// from the fine simplices, where it meets the rest from both; elsewhere interpolated between the body's
  /// nodes by their shape functions. Allocates nothing.
  void evaluate(std::span<const Vec3> u, std::span<const Vec3> contact_force, const Patch* patch,
                std::span<Stress> stress) noexcept;

 private:
  /// Facet of an element, or a simplex.
  struct Facet {
    ElementType type;
    std::span<const Index> nodes;  // surface nodes
    const HookesLaw* law;
  };

  [[nodiscard]] std::size_t facets() const noexcept { return element_.size(); }
  [[nodiscard]] Facet facet(std::size_t number) const noexcept;
  [[nodiscard]] Facet simplex(std::size_t number, std::size_t facet) const noexcept;
  [[nodiscard]] ElementNodes positions_of(std::span<const Index> nodes) const noexcept;
  [[nodiscard]] Vec3 normal_of(const Facet& facet) const noexcept;
  [[nodiscard]] std::vector<double> simplex_areas(std::span<const Index> simplices) const;
  [[nodiscard]] std::size_t place_on_patch(std::size_t facet, Index node) const noexcept;
  void number_facets();
  void measure();
  [[nodiscard]] std::vector<Vec3> nodal_forces_of_loads() const;
  void find_traction_of_loads();
  void refine_sides();
  void make_rows();
  void evaluate_patch(std::span<const Vec3> u, std::span<const Vec3> contact_force, const Patch& patch,
                      std::span<Stress> stress) noexcept;
  template <class PlaceOf>
  void add(const Facet& facet, const PlaceOf& place_of, std::span<const Vec3> u,
           std::span<const Vec3> contact_force, std::span<Stress> sum) noexcept;
  /// Number of the body's nodes, which come first.
  [[nodiscard]] std::size_t body_nodes() const noexcept { return body_.surface_mesh_nodes().size(); }

  const Body& body_;
  std::vector<HookesLaw> laws_;  // laws of the materials
  std::vector<Vec3> position_;   // [S] in the mesh
  ElementType facet_type_;
  std::vector<Index> facet_nodes_;   // [facets x nodes of one] surface nodes, in the order of boundary_sides
  std::vector<Index> element_;       // [facets]
  std::vector<std::uint8_t> known_;  // [facets] true if the traction is known
  std::size_t simplices_of_facet_;   // simplices per facet of a refined surface
  std::vector<Index> parents_;       // FineSurface::parents as surface nodes
  std::vector<double> area_;         // [S]
  std::optional<SurfaceSides> sides_;            // sides of the facets
  std::vector<Vec3> load_traction_;              // [places of sides_]
  std::optional<SurfaceSides> fine_sides_;       // sides of the simplices, if refined
  std::optional<SideTractions> fine_tractions_;  // due to contact forces
  std::vector<Vec3> fine_load_traction_;         // [places of fine_sides_]
  StressRows rows_;                              // [body's] due to displacement
  std::vector<std::size_t> first_of_force_;      // [body's + 1] begin of each node's entries below
  std::vector<Index> row_of_force_;              // node whose stress it changes
  std::vector<StressBlock> by_force_;            // [1/m^2]
  double rounding_ = std::numeric_limits<double>::infinity();  // [Pa] stress that is none, of what turns
  // Workspace.
  std::vector<Vec3> body_force_;        // [body's]
  std::vector<Mat3> turn_;              // [body's] rotations of their frames; empty for small strain
  std::vector<std::uint8_t> in_patch_;  // [elements]
  std::vector<std::uint8_t> on_patch_;  // [S]
  std::vector<double> weight_;          // [S]
};

}  // namespace palpate
