#include "precompute/inspect.h"

#include <fmt/format.h>

#include <algorithm>

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
  }
  return "unknown";
}

std::string histogram_text(const QualityReport& quality) {
  const std::int64_t most =
      *std::max_element(quality.dihedral_histogram.begin(), quality.dihedral_histogram.end());
  std::string text;
  for (std::size_t bin = 0; bin < quality.dihedral_histogram.size(); ++bin) {
    const std::int64_t count = quality.dihedral_histogram[bin];
    const auto bar = static_cast<std::size_t>(most > 0 ? 40 * count / most : 0);
    text +=
        fmt::format("    {:3}-{:3} deg {:9}  {}\n", 10 * bin, 10 * (bin + 1), count, std::string(bar, '#'));
  }
  return text;
}

}  // namespace

std::string inspect(const Model& model) {
  const QualityReport& q = model.quality;
  const bool single = model.greens.precision() == Precision::single_precision;
  const auto fixed = std::count(model.fixed.begin(), model.fixed.end(), 1);
  std::string text;
  text += fmt::format("{}, written by {}\n", model.name, model.generator);
  text += fmt::format("  content hash      {}\n", model.content_hash);
  text += fmt::format(
      "  mesh              {} nodes ({} fixed), {} tetrahedra, {} surface triangles, volume {:.4g} m^3\n",
      model.mesh.nodes.size(), fixed, model.mesh.tets.size(), model.surface_triangles.size(), q.volume);
  text += fmt::format("  material          E = {:g} Pa, nu = {:g}, density = {:g} kg/m^3\n",
                      model.material.youngs_modulus, model.material.poissons_ratio, model.material.density);
  text += fmt::format(
      "  Green's functions {}: {} nodes, {} dofs, {} precision, {:.1f} MB packed\n", scope_text(model),
      model.stored_nodes.size(), model.stored_dofs(), single ? "single" : "double",
      static_cast<double>(packed_size(model.stored_dofs()) * bytes_per_scalar(model.greens.precision())) *
          1e-6);
  text += fmt::format("  probes            {}\n", model.probes.size());
  text += fmt::format("  edges             {:.4g} to {:.4g} m\n", q.min_edge, q.max_edge);
  text += fmt::format("  dihedral angles   {:.2f} to {:.2f} deg\n", q.min_dihedral, q.max_dihedral);
  text +=
      fmt::format("  radius ratio      worst {:.4f} (element {} at {:.4g}, {:.4g}, {:.4g} m), mean {:.3f}\n",
                  q.min_radius_ratio, q.worst_element, q.worst_centroid.x(), q.worst_centroid.y(),
                  q.worst_centroid.z(), q.mean_radius_ratio);
  text += "  dihedral angles of all elements\n" + histogram_text(q);
  text += "  made from\n";
  for (const SourceFile& source : model.sources) {
    text +=
        fmt::format("    {:9} {} ({} bytes, {})\n", source.role, source.path, source.bytes, source.checksum);
  }
  return text;
}

}  // namespace palpate
