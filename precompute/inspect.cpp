#include "precompute/inspect.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numbers>

#include "base/printable.h"
#include "formats/model_check.h"
#include "meshes/material_fields.h"
#include "precompute/compressed_greens.h"
#include "precompute/numerics/precision.h"

namespace palpate {
namespace {

std::string scope_text(const Model& model) {
  switch (model.scope) {
    case Scope::surface:
      return "surface";
    case Scope::layers:
      return fmt::format("surface + {} layer{}", model.layers, model.layers == 1 ? "" : "s");
    case Scope::full:
      return "full";
    case Scope::none:
      return "none";
  }
  return "unknown";
}

std::string histogram_text(const QualityReport& quality) {
  const std::int64_t most = *std::max_element(quality.angle_histogram.begin(), quality.angle_histogram.end());
  std::string text;
  for (std::size_t bin = 0; bin < quality.angle_histogram.size(); ++bin) {
    const std::int64_t count = quality.angle_histogram[bin];
    const auto bar = static_cast<std::size_t>(most > 0 ? 40 * count / most : 0);
    text +=
        fmt::format("    {:3}-{:3} deg {:9}  {}\n", 10 * bin, 10 * (bin + 1), count, std::string(bar, '#'));
  }
  return text;
}

std::string analysis_text(const Model& model) {
  switch (model.analysis) {
    case Analysis::solid:
      return "solid";
    case Analysis::plane_stress:
      return fmt::format("plane stress, thickness {:g} m", model.thickness);
    case Analysis::plane_strain:
      return fmt::format("plane strain, thickness {:g} m", model.thickness);
  }
  return "unknown";
}

/// One line per material.
std::string materials_text(const Model& model) {
  std::vector<std::int64_t> elements(model.materials.size(), 0);
  for (const Index material : model.material_of_element) ++elements[static_cast<std::size_t>(material)];
  std::string text;
  for (std::size_t m = 0; m < model.materials.size(); ++m) {
    std::string lists;
    text += fmt::format("  material {:<8} ", m + 1);
    for_each_material_field(
        model.materials[m], [&](const MaterialField& field, std::span<const double> values) {
          const std::string unit = field.unit.empty() ? "" : " " + std::string(field.unit);
          if (values.size() == 1) {
            text += fmt::format("{} = {:g}{}, ", field.symbol, values[0], unit);
          } else if (std::ranges::any_of(values, [](double value) { return value != 0.0; })) {
            lists += fmt::format("    {:<15} {:g}{}\n", field.symbol, fmt::join(values, ", "), unit);
          }
        });
    text += fmt::format("{} elements\n", elements[m]) + lists;
  }
  return text;
}

/// Text on the smooth part and the measured force errors.
std::string precision_text(const Model& model) {
  std::string text;
  if (const SmoothPart* smooth = model.greens.smooth().get(); smooth != nullptr)
    text += fmt::format("    smooth part     {} terms, {:.1f} MB in double\n", smooth->terms,
                        8e-6 * static_cast<double>(smooth->rows.size()));
  std::vector<ForceErrors> errors = {model.force_errors};
  if (model.dynamics.method == DynamicsMethod::packed) errors.push_back(model.dynamics.force_errors);
  const std::string measured = errors_text(errors);
  text += fmt::format("    force errors    {}\n", measured.empty() ? "not measured" : measured);
  if (const std::string warning = precision_warning(model, model.greens.precision()); !warning.empty())
    text += "    WARNING         " + warning + "\n";
  return text;
}

std::string compressed_text(const Model& model) {
  const HierarchicalMatrix& matrix = *model.compressed;
  const auto megabytes = [](std::int64_t floats) { return 4e-6 * static_cast<double>(floats); };
  return fmt::format(
      "  Green's functions {}: {} nodes, {} dofs, compressed to {:.1f} MB\n"
      "    near pairs      {} of leaves of up to {} nodes, {:.1f} MB\n"
      "    far pairs       {} on {} levels, ranks up to {}: couplings {:.1f} MB, bases {:.1f} MB\n"
      "    tolerance       {:g}; force errors of random touches, measured:\n{}\n",
      scope_text(model), model.stored_nodes.size(), model.stored_dofs(),
      1e-6 * static_cast<double>(matrix.bytes()), matrix.near_pair.size(),
      (matrix.tree.nodes + matrix.tree.leaves() - 1) / matrix.tree.leaves(), megabytes(matrix.near_at.back()),
      matrix.far_pair.size(), matrix.tree.levels, *std::max_element(matrix.rank.begin(), matrix.rank.end()),
      megabytes(matrix.coupling_at.back()), megabytes(matrix.basis_at.back() + matrix.transfer_at.back()),
      matrix.tolerance, certificate_text(matrix));
}

/// Text on stored overlays; empty if there are none.
std::string overlay_text(const Model& model) {
  const StoredOverlay& overlay = model.overlay;
  if (overlay.refinement == 0) return "";
  std::int64_t entries = 0;
  for (const CondensedPatch& patch : overlay.patches)
    entries += packed_size(patch.G.rows()) + patch.T.size() + packed_size(patch.compliance.rows());
  return fmt::format("  overlays          {} patches, r = {}, {} ring{}, {:.1f} MB\n", overlay.patches.size(),
                     overlay.refinement, overlay.rings, overlay.rings == 1 ? "" : "s",
                     8e-6 * static_cast<double>(entries));
}

/// Text on damping a M + b K.
std::string damping_text(const Rayleigh& damping) {
  if (damping.mass == 0.0 && damping.stiffness == 0.0) return "no damping";
  return fmt::format("damping {:.4g}/s M + {:.4g} s K", damping.mass, damping.stiffness);
}

/// Text on dynamics; empty if there are none.
std::string dynamics_text(const Model& model) {
  const StoredDynamics& dynamics = model.dynamics;
  if (dynamics.method == DynamicsMethod::none) return "";
  std::string text;
  if (dynamics.method == DynamicsMethod::packed) {
    text = fmt::format("  dynamics          packed: inverse of K_bar, {:.1f} MB; M and C_d of {} entries\n",
                       static_cast<double>(packed_size(dynamics.inverse.order()) *
                                           bytes_per_scalar(dynamics.inverse.precision())) *
                           1e-6,
                       dynamics.matrices.row.size());
  } else {
    const auto modes = static_cast<std::size_t>(dynamics.modes());
    std::vector<double> hertz;
    for (std::size_t i = 0; i < modes; ++i) hertz.push_back(dynamics.omega[i] / (2.0 * std::numbers::pi));
    const std::vector<double> first(hertz.begin(),
                                    hertz.begin() + std::min<std::ptrdiff_t>(5, dynamics.modes()));
    text = fmt::format("  dynamics          modal: {} modes of {:.4g}{} to {:.4g} Hz, {:.1f} MB\n", modes,
                       fmt::join(first, ", "), modes > first.size() ? ", ..." : "", hertz.back(),
                       8e-6 * static_cast<double>(dynamics.shapes.size()));
  }
  const Newmark& newmark = dynamics.newmark;
  return text + fmt::format("    Newmark         time step {:g} s, alpha = {:g}, delta = {:g}; {} mass, {}\n",
                            newmark.time_step, newmark.alpha, newmark.delta,
                            dynamics.lumped ? "lumped" : "consistent", damping_text(dynamics.damping));
}

/// Text on the largest displacement at rest and the total force of the loads.
std::string rest_text(const Model& model) {
  Vec3 total = Vec3::Zero();
  double largest = 0.0;
  for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node) {
    total += model.rest_force[node];
    largest = std::max(largest, model.rest_displacement[node].norm());
  }
  if (largest == 0.0) return "  rest state        undeformed\n";
  return fmt::format("  rest state        moved by up to {:.4g} m; loads ({:.4g}, {:.4g}, {:.4g}) N in all\n",
                     largest, total.x(), total.y(), total.z());
}

}  // namespace

std::string inspect(const Model& model) {
  const QualityReport& q = model.quality;
  const bool plane = model.dimension() == 2;
  const auto held =
      std::count_if(model.fixed.begin(), model.fixed.end(), [](auto mask) { return mask != 0; });
  std::string text;
  text += fmt::format("{}, written by {}\n", printable(model.name), printable(model.generator));
  text += fmt::format("  content hash      {}\n", printable(model.content_hash));
  text +=
      fmt::format("  mesh              {} nodes ({} held), {} {} elements, {} surface {}, {} {:.4g} {}\n",
                  model.mesh.nodes.size(), held, model.mesh.elements(), traits(model.mesh.element).name,
                  model.surface.size() / static_cast<std::size_t>(model.dimension()),
                  plane ? "lines" : "triangles", plane ? "area" : "volume", q.volume, plane ? "m^2" : "m^3");
  text += fmt::format("  analysis          {}\n", analysis_text(model));
  text += materials_text(model);
  text += rest_text(model);
  if (const std::string warning = rest_warning(model); !warning.empty())
    text += "    WARNING         " + warning + "\n";
  if (model.scope == Scope::none) {
    text += "  Green's functions none: for solvers that need none\n";
  } else if (model.compressed != nullptr) {
    text += compressed_text(model);
  } else {
    text += fmt::format(
        "  Green's functions {}: {} nodes, {} dofs, {} precision, {:.1f} MB packed\n", scope_text(model),
        model.stored_nodes.size(), model.stored_dofs(), name_of(model.greens.precision()),
        static_cast<double>(packed_size(model.stored_dofs()) * bytes_per_scalar(model.greens.precision())) *
            1e-6);
    text += precision_text(model);
  }
  text += overlay_text(model);
  text += dynamics_text(model);
  text += fmt::format("  probes            {}\n", model.probes.size());
  text += fmt::format("  edges             {:.4g} to {:.4g} m\n", q.min_edge, q.max_edge);
  text += fmt::format("  {:17} {:.2f} to {:.2f} deg\n", plane ? "corner angles" : "dihedral angles",
                      q.min_angle, q.max_angle);
  const bool simplices = traits(model.mesh.element).corners == model.dimension() + 1;
  text += fmt::format("  {:17} worst {:.4f} (element {} at {:.4g}, {:.4g}, {:.4g} m), mean {:.3f}\n",
                      simplices ? "radius ratio" : "scaled Jacobian", q.min_shape, q.worst_element,
                      q.worst_centroid.x(), q.worst_centroid.y(), q.worst_centroid.z(), q.mean_shape);
  text += "  angles of all elements\n" + histogram_text(q);
  text += "  made from\n";
  for (const SourceFile& source : model.sources) {
    text += fmt::format("    {:9} {} ({} bytes, {})\n", printable(source.role), printable(source.path),
                        source.bytes, printable(source.checksum));
  }
  return text;
}

}  // namespace palpate
