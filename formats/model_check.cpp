#include "formats/model_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>

#include "base/error.h"
#include "formats/dynamics_fields.h"
#include "formats/hierarchical_fields.h"
#include "meshes/element.h"
#include "meshes/material_fields.h"

namespace palpate {
namespace {

/// Sets the counts that the sizes of the patches' matrices imply.
void count_patches(const Model& model, Counts& counts) {
  counts.set(Count::patches, std::ssize(model.overlay.patches), "/overlay/centres");
  std::int64_t surface = 0, softening = 0, transfer = 0, compliance = 0;
  for (const CondensedPatch& patch : model.overlay.patches) {
    surface += patch.compliance.cols() / model.dimension();
    softening += packed_size(patch.G.cols());
    transfer += patch.compliance.cols() * patch.G.cols();
    compliance += packed_size(patch.compliance.cols());
  }
  counts.set(Count::patch_surface_nodes, surface, "/overlay/surface_nodes");
  counts.set(Count::patch_softening_entries, softening, "/overlay/nodes");
  counts.set(Count::patch_transfer_entries, transfer, "/overlay/nodes");
  counts.set(Count::patch_compliance_entries, compliance, "/overlay/surface_nodes");
}

void check_plane(const std::vector<Vec3>& rows, const std::string& path, const std::string& where) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].z() != 0.0)
      refuse(where, path + ": row " + std::to_string(i) + " has z = " + std::to_string(rows[i].z()) +
                        ", in the plane it is 0");
  }
}

void check_materials(const Model& model, const std::string& where) {
  for (std::size_t m = 0; m < model.materials.size(); ++m) {
    for_each_material_field(model.materials[m],
                            [&](const MaterialField& field, std::span<const double> numbers) {
                              for (const double number : numbers) {
                                if (!field.range.contains(number))
                                  refuse(where, fmt::format("{}, row {} is {}: {} must be {}", field.dataset,
                                                            m, number, field.key, field.range.words));
                              }
                            });
  }
}

void check_elements(const Mesh& mesh, const std::string& where) {
  for (Index e = 0; e < mesh.elements(); ++e)
    if (!(smallest_determinant(mesh.element, element_nodes(mesh, e)) > 0.0))
      refuse(where, "/mesh/connectivity: element " + std::to_string(e) + " is inverted or flat");
}

void check_surface(const Model& model, const std::string& where) {
  const auto corners = static_cast<std::size_t>(model.dimension());
  for (std::size_t at = 0; at < model.surface.size(); at += corners) {
    for (std::size_t i = at; i < at + corners; ++i) {
      for (std::size_t j = at; j < i; ++j)
        if (model.surface[i] == model.surface[j])
          refuse(where, "/mesh/surface: row " + std::to_string(at / corners) + " has the same node twice");
    }
  }
}

void check_stored_nodes(const Model& model, const std::string& where) {
  const int all_axes = (1 << model.dimension()) - 1;
  std::vector<bool> stored(model.mesh.nodes.size(), false);
  for (const Index node : model.stored_nodes) {
    const auto i = static_cast<std::size_t>(node);
    if (model.fixed[i] == all_axes)
      refuse(where, "/dofs/stored_nodes: node " + std::to_string(node) + " is fixed");
    if (stored[i]) refuse(where, "/dofs/stored_nodes: node " + std::to_string(node) + " is there twice");
    stored[i] = true;
  }
}

/// Throws Error if a model without Green's functions has data that need them.
void check_nothing_stored(const Model& model, const std::string& where) {
  if (!model.stored_nodes.empty())
    refuse(where, "/dofs/stored_nodes has " + std::to_string(model.stored_nodes.size()) +
                      " entries, but the scope is none");
  if (model.overlay.refinement != 0 || model.dynamics.method != DynamicsMethod::none)
    refuse(where, "the scope is none, but there are overlays or dynamics");
}

void check_range(const char* path, int value, int low, int high, const std::string& where) {
  if (value < low || value > high)
    refuse(where, std::string(path) + " is " + std::to_string(value) + ", only " + std::to_string(low) +
                      " to " + std::to_string(high) + " are possible");
}

/// Checks the overlay. Patches are checked against their fine meshes when those are made.
void check_overlay(const Model& model, const std::string& where) {
  const StoredOverlay& overlay = model.overlay;
  check_range("/overlay/refinement", overlay.refinement, least_refinement, most_refinement, where);
  check_range("/overlay/rings", overlay.rings, 1, most_rings, where);
  std::vector<bool> stored(model.mesh.nodes.size(), false), touched(model.mesh.nodes.size(), false);
  for (const Index node : model.stored_nodes) stored[static_cast<std::size_t>(node)] = true;
  for (const Index node : model.surface) touched[static_cast<std::size_t>(node)] = true;
  for (std::size_t k = 0; k < overlay.centres.size(); ++k) {
    const auto node = static_cast<std::size_t>(overlay.centres[k]);
    if (!stored[node] || !touched[node])
      refuse(where, "/overlay/centres: node " + std::to_string(node) +
                        (touched[node] ? " is not stored" : " is not on the surface"));
    if (k > 0 && overlay.centres[k - 1] >= overlay.centres[k])
      refuse(where, "/overlay/centres: entry " + std::to_string(k) + " is not greater than the one before");
    const CondensedPatch& patch = overlay.patches[k];
    if (!std::is_sorted(patch.surface.begin(), patch.surface.end(), std::less_equal<>()))
      refuse(where, "/overlay/surface: the nodes of patch " + std::to_string(k) + " do not ascend");
    if (patch.compliance.size() > 0 && patch.compliance.diagonal().minCoeff() < 0.0)
      refuse(where, "/overlay/compliance: patch " + std::to_string(k) + " has a negative diagonal entry");
  }
}

}  // namespace

Counts counts_of(const Model& model, std::string where) {
  Counts counts(std::move(where));
  if (model.scope == Scope::none) counts.allow_none_stored();
  const auto set = [&counts](Count count, std::size_t value, const char* path) {
    counts.set(count, static_cast<std::int64_t>(value), path);
  };
  set(Count::nodes, model.mesh.nodes.size(), "/mesh/nodes");
  set(Count::elements, static_cast<std::size_t>(model.mesh.elements()), "/mesh/connectivity");
  set(Count::simplices, model.surface.size() / static_cast<std::size_t>(model.dimension()), "/mesh/surface");
  set(Count::materials, model.materials.size(), "/material/isotropic");
  set(Count::stored_nodes, model.stored_nodes.size(), "/dofs/stored_nodes");
  set(Count::probes, model.probes.size(), "/probes/forces");
  set(Count::bytes_of_text, model.model_toml.size(), "/model_toml");
  set(Count::bytes_of_sources, sources_text(model).size(), "/provenance/sources");
  if (model.overlay.refinement != 0) count_patches(model, counts);
  if (model.dynamics.method == DynamicsMethod::packed)
    set(Count::matrix_entries, model.dynamics.matrices.row.size(), "/dynamics/matrices/row");
  if (model.dynamics.method == DynamicsMethod::modal)
    counts.set(Count::modes, model.dynamics.modes(), "/dynamics/modes/omega");
  if (model.greens.smooth() != nullptr)
    counts.set(Count::smooth_terms, model.greens.smooth()->terms, "/greens/smooth");
  if (model.compressed != nullptr) count_tree(*model.compressed, counts);
  return counts;
}

void check_model(const Model& model, const std::string& where) {
  const bool solid = model.dimension() == 3;
  if ((model.analysis == Analysis::solid) != solid)
    refuse(where, "the attribute analysis is " + text_of(model.analysis) + ", but " +
                      text_of(model.mesh.element) + " elements are " + (solid ? "in space" : "in the plane"));
  if (!(model.thickness > 0.0) || (solid && model.thickness != 1.0))
    refuse(where, "/material/thickness is " + std::to_string(model.thickness) +
                      (solid ? ", in space it is 1" : ", not positive"));
  check_materials(model, where);
  if (!solid) {
    check_plane(model.mesh.nodes, "/mesh/nodes", where);
    check_plane(model.rest_force, "/rest/force", where);
    check_plane(model.rest_displacement, "/rest/displacement", where);
  }
  check_elements(model.mesh, where);
  check_surface(model, where);
  check_stored_nodes(model, where);
  if (model.scope == Scope::none) check_nothing_stored(model, where);
  if (model.overlay.refinement != 0) check_overlay(model, where);
  if (model.dynamics.method != DynamicsMethod::none) check_dynamics(model, where);
}

std::string rest_warning(const Model& model) {
  Eigen::AlignedBox3d box;
  double moved = 0.0;
  for (const Vec3& x : model.mesh.nodes) box.extend(x);
  for (const Vec3& u : model.rest_displacement) moved = std::max(moved, u.norm());
  const double size = box.isEmpty() ? 0.0 : box.diagonal().norm();
  if (moved <= small_strain * size) return {};
  return fmt::format(
      "at rest the loads move the body by up to {:.3g} m, more than a tenth of its size, {:.3g} m: that is "
      "beyond "
      "small strain, and its shape and forces are wrong; check youngs_modulus, which is in Pa, and [[load]]",
      moved, size);
}

}  // namespace palpate
