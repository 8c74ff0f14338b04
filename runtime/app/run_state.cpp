#include "runtime/app/run_state.h"

#include <algorithm>
#include <cstddef>

#include "meshes/element_type.h"
#include "runtime/app/fitting_tool.h"
#include "runtime/body/overlay_rings.h"
#include "runtime/depth/deep_body.h"
#include "runtime/depth/studied_range.h"
#include "runtime/loop/monitor.h"
#include "runtime/viewer/run_words.h"

namespace palpate {
namespace {

nlohmann::json text_or_null(const std::optional<std::string>& text) {
  return text ? nlohmann::json(*text) : nlohmann::json();
}

nlohmann::json number_or_null(const std::optional<double>& number) {
  return number ? nlohmann::json(*number) : nlohmann::json();
}

nlohmann::json error_or_null(const std::optional<Error>& error) {
  return error ? error_members(*error) : nlohmann::json();
}

nlohmann::json vector(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

nlohmann::json fault_or_null(Fault fault) {
  if (fault == Fault::none) return {};
  return {{"name", fault_names[static_cast<std::size_t>(fault)].second}, {"remedy", fault_remedy(fault)}};
}

nlohmann::json change_or_null(const std::optional<SurfaceChange>& change) {
  if (!change) return {};
  return {{"rotation", change->rotation}, {"strain", change->strain}};
}

bool has_loads(const Model& model) {
  const auto is_there = [](const Vec3& vector) { return vector != Vec3::Zero(); };
  return std::any_of(model.rest_displacement.begin(), model.rest_displacement.end(), is_there) ||
         std::any_of(model.rest_force.begin(), model.rest_force.end(), is_there);
}

/// Returns Young's moduli of the materials, in the order of their numbers [Pa].
nlohmann::json youngs_moduli(const Model& model) {
  nlohmann::json moduli = nlohmann::json::array();
  for (const Material& material : model.materials) moduli.push_back(material.youngs_modulus);
  return moduli;
}

}  // namespace

nlohmann::json to_json(const RunState& state) {
  return {{"scene", state.scene},
          {"model", state.model},
          {"defaults", state.defaults},
          {"settings", state.settings},
          {"tool_note", state.tool_note},
          {"device", state.device},
          {"pointer", state.pointer},
          {"hand", state.hand},
          {"rate", state.rate},
          {"ticks", state.ticks},
          {"misses", state.misses},
          {"paused", state.paused},
          {"recording", text_or_null(state.recording)},
          {"recording_failed", error_or_null(state.recording_failed)},
          {"busy", text_or_null(state.busy)},
          {"refused", error_or_null(state.refused)},
          {"locked", text_or_null(state.locked)},
          {"fault", fault_or_null(state.fault)},
          {"change", change_or_null(state.change)},
          {"small_strain", state.small_strain},
          {"phase", safety_phase_names[static_cast<std::size_t>(state.phase)].second}};
}

nlohmann::json describe_model(const Body& body, const std::string& file) {
  const Model& model = body.model();
  return {{"name", model.name},
          {"file", file},
          {"dimension", model.dimension()},
          {"nodes", model.mesh.nodes.size()},
          {"surface_nodes", body.surface_mesh_nodes().size()},
          {"elements", model.mesh.elements()},
          {"dofs", body.greens().order()},
          {"element", traits(model.mesh.element).name},
          {"size", body.bounds().diagonal().norm()},
          {"bounds", {vector(body.bounds().min()), vector(body.bounds().max())}},
          {"moves",
           model.dynamics.method != DynamicsMethod::none && body.contact_model() != ContactModel::two_level},
          {"deep", body.contact_model() == ContactModel::two_level},
          {"goes_deep", goes_deep(model)},
          {"loads", has_loads(model)},
          {"materials", youngs_moduli(model)},
          {"studied_rotation", number_or_null(studied_rotation(body))},
          {"overlay_rings", overlay_rings(body)},
          {"overlay_refinement", {least_refinement, most_refinement}}};
}

nlohmann::json describe_defaults(const Body& body) {
  constexpr double share = 0.05;           // fraction of the body's diagonal
  constexpr double share_of_least = 0.25;  // fraction of its smallest extent
  const Vec3 extent = body.bounds().max() - body.bounds().min();
  const double least = body.dimension() == 2 ? std::min(extent.x(), extent.y()) : extent.minCoeff();
  return {{"radius", fitting_radius(body)},
          {"reach", body.longest_surface_edge()},
          {"friction", body.surface_friction().front()},
          {"depth", std::min(share * extent.norm(), share_of_least * least)}};
}

}  // namespace palpate
