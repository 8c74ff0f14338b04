#include "formats/model_check.h"

#include <limits>

#include "meshes/error.h"
#include "meshes/tet4.h"

namespace palpate {
namespace {

constexpr std::int64_t unknown = -1;

std::int64_t smallest(Count count) {
  switch (count) {
    case Count::one:
    case Count::elements:
    case Count::stored_nodes:
      return 1;
    case Count::nodes:
      return 4;
    default:
      return 0;
  }
}

bool counts_index_numbers(Count count) {
  return count == Count::nodes || count == Count::elements || count == Count::triangles ||
         count == Count::stored_nodes;
}

}  // namespace

void refuse(const std::string& where, const std::string& what) {
  throw Error(what, where, "Copy the file again, or precompute it again.");
}

Counts::Counts(std::string where) : where_(std::move(where)) {
  values_.fill(unknown);
  values_[static_cast<std::size_t>(Count::one)] = 1;
}

Counts Counts::of(const Model& model, std::string where) {
  Counts counts(std::move(where));
  const auto set = [&counts](Count count, std::size_t value, const char* path) {
    counts.set(count, static_cast<std::int64_t>(value), path);
  };
  set(Count::nodes, model.mesh.nodes.size(), "/mesh/nodes");
  set(Count::elements, model.mesh.tets.size(), "/mesh/connectivity");
  set(Count::triangles, model.surface_triangles.size(), "/mesh/surface_triangles");
  set(Count::stored_nodes, model.stored_nodes.size(), "/dofs/stored_nodes");
  set(Count::probes, model.probes.size(), "/probes/forces");
  set(Count::bytes_of_text, model.model_toml.size(), "/model_toml");
  set(Count::bytes_of_sources, sources_text(model).size(), "/provenance/sources");
  return counts;
}

void Counts::set(Count count, std::int64_t value, const char* told_by) {
  if (value < smallest(count))
    refuse(where_, std::string(told_by) + " has " + std::to_string(value) + " entries, at least " +
                       std::to_string(smallest(count)) + " are needed");
  if (counts_index_numbers(count) && value > std::numeric_limits<Index>::max() / 8)
    refuse(where_,
           std::string(told_by) + " has " + std::to_string(value) + " entries, more than can be numbered");
  values_[static_cast<std::size_t>(count)] = value;
  told_by_[static_cast<std::size_t>(count)] = told_by;
}

std::int64_t Counts::size(const Extent& extent) const {
  return extent.factor * values_[static_cast<std::size_t>(extent.count)] + extent.plus;
}

std::vector<std::int64_t> Counts::sizes(const std::vector<Extent>& shape) const {
  std::vector<std::int64_t> result;
  result.reserve(shape.size());
  for (const Extent& extent : shape) result.push_back(size(extent));
  return result;
}

void Counts::match(const char* path, const std::vector<Extent>& shape,
                   const std::vector<std::int64_t>& dims) {
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const Extent& extent = shape[i];
    const auto which = static_cast<std::size_t>(extent.count);
    if (values_[which] == unknown) set(extent.count, (dims[i] - extent.plus) / extent.factor, path);
    if (dims[i] == size(extent)) continue;
    const bool by_another = told_by_[which] != nullptr && told_by_[which] != std::string(path);
    const std::string teller = by_another ? std::string(" by ") + told_by_[which] : "";
    refuse(where_, std::string(path) + " has size " + std::to_string(dims[i]) + ", " +
                       std::to_string(size(extent)) + " is expected" + teller);
  }
}

void check_model(const Model& model, const std::string& where) {
  check_material(model.material, where + ": /material/isotropic");

  for (std::size_t e = 0; e < model.mesh.tets.size(); ++e)
    if (!(tet4::volume(tet4::corners(model.mesh, model.mesh.tets[e])) > 0.0))
      refuse(where, "/mesh/connectivity: element " + std::to_string(e) + " does not have a positive volume");

  for (std::size_t f = 0; f < model.surface_triangles.size(); ++f) {
    const Triangle& t = model.surface_triangles[f];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      refuse(where, "/mesh/surface_triangles: triangle " + std::to_string(f) + " has the same node twice");
  }

  std::vector<bool> stored(model.mesh.nodes.size(), false);
  for (const Index node : model.stored_nodes) {
    const auto i = static_cast<std::size_t>(node);
    if (model.fixed[i] != 0) refuse(where, "/dofs/stored_nodes: node " + std::to_string(node) + " is fixed");
    if (stored[i]) refuse(where, "/dofs/stored_nodes: node " + std::to_string(node) + " is there twice");
    stored[i] = true;
  }
}

}  // namespace palpate
