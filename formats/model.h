// The baked model: the contents of NAME.palpate.hdf.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "formats/condensed_patch.h"
#include "matrices/newmark.h"
#include "matrices/packed.h"
#include "meshes/material.h"
#include "meshes/mesh.h"
#include "meshes/quality.h"

namespace palpate {

struct HierarchicalMatrix;

/// Rows and columns of Xi that are stored (theory.md section 2). All are exact; nodes outside carry no force.
enum class Scope : std::uint8_t {
  surface,  ///< free nodes on the surface
  layers,   ///< surface nodes and the free interior nodes within `layers` elements of the surface
  full,     ///< all free nodes
  none,     ///< none: for solvers that need no Green's functions
};

/// A file that the model was made from, recorded to detect stale models.
struct SourceFile {
  std::string role;        ///< "model" for model.toml, "geometry" for the mesh, surface or image
  std::string path;        ///< relative to the folder of the baked file, '/' separated
  std::int64_t bytes = 0;  ///< size when it was read
  std::string checksum;    ///< XXH3-128 of its bytes, 32 hexadecimal digits
};

/// Force on all stored dofs and the resulting displacement, with which a file can be verified without the
/// model.
struct Probe {
  std::vector<double> force;         ///< [n] on the stored dofs [N]
  std::vector<double> displacement;  ///< [n] of the stored dofs [m], by a sparse solve with K
};

/// Worst relative force error of touches for a packed matrix in each Precision, measured when it was computed
/// (docs/model-toml.md); infinity if a capacitance matrix is not positive definite.
struct ForceErrors {
  static constexpr double not_measured = -1.0;
  std::array<double, 3> of_precision = {not_measured, not_measured, not_measured};

  [[nodiscard]] double operator[](Precision precision) const noexcept {
    return of_precision[static_cast<std::size_t>(precision)];
  }
  [[nodiscard]] double& operator[](Precision precision) noexcept {
    return of_precision[static_cast<std::size_t>(precision)];
  }
  /// True if any precision was measured.
  [[nodiscard]] bool any() const noexcept {
    return of_precision[0] >= 0.0 || of_precision[1] >= 0.0 || of_precision[2] >= 0.0;
  }
};

/// Force errors above it cause a warning, and precision "auto" avoids them if another form has less.
inline constexpr double good_force_error = 1e-4;

/// Limits of overlays.
inline constexpr int least_refinement = 2, most_refinement = 16, most_rings = 16;

/// Overlays condensed in advance, each over the elements within some rings around one node.
struct StoredOverlay {
  int refinement = 0;                   ///< r: each element is cut into r^d; 0: no overlays are stored
  int rings = 0;                        ///< of elements around the centres
  std::vector<Index> centres;           ///< [P] mesh nodes on the surface, ascending
  std::vector<CondensedPatch> patches;  ///< [P]
};

/// A symmetric sparse matrix pair of the stored dofs by columns of the lower triangle.
struct MassAndDamping {
  std::vector<std::int64_t> start;  ///< [n + 1] first entry of each column
  std::vector<Index> row;           ///< [entries] ascending in a column, none above the diagonal
  std::vector<double> mass;         ///< [entries] M [kg]
  std::vector<double> damping;      ///< [entries] C_d [N s/m]
};

/// Input of Newmark's method (theory.md section 5).
struct StoredDynamics {
  DynamicsMethod method = DynamicsMethod::none;
  bool lumped = false;  ///< M is diagonal
  Newmark newmark;
  Rayleigh damping;
  MassAndDamping matrices;     ///< packed
  PackedGreens inverse;        ///< packed: K_bar^-1 of the stored dofs [m/N]
  ForceErrors force_errors;    ///< packed: of the inverse
  std::vector<double> omega;   ///< modal: [k + 1] angular frequencies [rad/s], ascending; the last is that of
                               ///< the first mode not kept (infinity if all are)
  std::vector<double> shapes;  ///< modal: [k x n] the modes at the stored dofs, phi^T M phi = 1 [1/sqrt(kg)]

  [[nodiscard]] Index modes() const noexcept {  ///< k
    return omega.empty() ? 0 : static_cast<Index>(omega.size()) - 1;
  }
};

/// All baked data. Constant once loaded, used by all threads. With d = dimension(), a stored dof is
/// d k + axis for stored node k; `stored_nodes[k]` is its mesh node. A node held along some axes only is
/// stored whole: rows and columns of its held dofs are zero.
struct Model {
  std::string name;        ///< from model.toml
  std::string generator;   ///< program and version that wrote it
  std::string model_toml;  ///< text of the description, byte for byte
  Mesh mesh;
  std::vector<Index> surface;  ///< [F * d] mesh node numbers of triangles (in the plane, of lines), outward:
                               ///< see surface_simplices
  Analysis analysis = Analysis::solid;
  double thickness = 1.0;                    ///< in the plane [m]; 1 in space
  std::vector<Material> materials;           ///< [M] at least one
  std::vector<Index> material_of_element{};  ///< [E] index of each element's material
  std::vector<std::uint8_t> fixed;           ///< [N] bit `axis` is set if the node is held along it
  std::vector<Vec3> rest_force;              ///< [N] constant nodal force of the loads [N]
  std::vector<Vec3> rest_displacement;       ///< [N] u0 [m]: K u0 = rest_force, held dofs as prescribed. The
                                             ///< visible position is node + u0 + u; contact displaces
                                             ///< relative to u0
  std::vector<Index>
      stored_nodes;  ///< [n/d] mesh node of each stored node, in the elimination order of the factor
  Scope scope = Scope::layers;
  Index layers = 1;  ///< element layers below the surface that are kept (scope layers); 0 otherwise
  QualityReport quality;
  std::vector<SourceFile> sources;
  std::vector<Probe> probes;
  StoredOverlay overlay;
  StoredDynamics dynamics;
  /// Xi of the stored dofs [m/N], packed or, with `greens` empty, in nested low-rank form.
  PackedGreens greens;
  std::shared_ptr<const HierarchicalMatrix> compressed;
  ForceErrors force_errors;  ///< of greens
  std::string content_hash;  ///< XXH3-128 over all datasets; empty until written

  /// Dofs per node d: 2 in the plane, 3 in space.
  [[nodiscard]] int dimension() const noexcept { return mesh.dimension(); }
  [[nodiscard]] std::int64_t stored_dofs() const noexcept {
    return dimension() * static_cast<std::int64_t>(stored_nodes.size());
  }
};

/// Warning if the stored precision causes force errors above good_force_error, with the error; empty if not,
/// or if nothing was measured.
std::string precision_warning(const Model& model, Precision precision);

}  // namespace palpate
