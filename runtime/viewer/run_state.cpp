#include "runtime/viewer/run_state.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include "meshes/element_type.h"
#include "runtime/monitor.h"
#include "runtime/output.h"

namespace palpate {
namespace {

std::string text_or_null(const std::optional<std::string>& text) {
  return text ? json_string(*text) : "null";
}

/// The name of a numbered constant.
template <class Names>
std::string_view name_of(const Names& names, std::size_t number) {
  return names[std::min(number, names.size() - 1)].second;
}

std::string fault_json(Fault fault) {
  if (fault == Fault::none) return "null";
  return fmt::format(R"({{"name": {}, "remedy": {}}})",
                     json_string(name_of(fault_names, static_cast<std::size_t>(fault))),
                     json_string(fault_remedy(fault)));
}

bool has_loads(const Model& model) {
  const auto is_there = [](const Vec3& vector) { return vector != Vec3::Zero(); };
  return std::any_of(model.rest_displacement.begin(), model.rest_displacement.end(), is_there) ||
         std::any_of(model.rest_force.begin(), model.rest_force.end(), is_there);
}

}  // namespace

std::string to_json(const RunState& state) {
  std::string settings;
  for (const auto& [name, value] : state.settings)
    settings += (settings.empty() ? "" : ", ") + json_string(name) + ": " + json_string(value);
  std::string json = fmt::format(R"({{"scene": {}, "model": {}, "defaults": {}, "settings": {{{}}})",
                                 state.scene, state.model, state.defaults, settings);
  json += fmt::format(R"(, "device": {}, "pointer": {}, "rate": {}, "ticks": {}, "misses": {}, "paused": {})",
                      json_string(state.device), state.pointer, state.rate, state.ticks, state.misses,
                      state.paused);
  json += fmt::format(R"(, "recording": {}, "busy": {}, "refused": {}, "locked": {})",
                      text_or_null(state.recording), text_or_null(state.busy), text_or_null(state.refused),
                      text_or_null(state.locked));
  json += fmt::format(R"(, "fault": {}, "phase": {}}})", fault_json(state.fault),
                      json_string(name_of(safety_phase_names, static_cast<std::size_t>(state.phase))));
  return json;
}

std::string describe_model(const Body& body, const std::string& file) {
  const Model& model = body.model();
  return fmt::format(
      R"({{"name": {}, "file": {}, "dimension": {}, "nodes": {}, "surface_nodes": {}, "elements": {}, )"
      R"("dofs": {}, "element": {}, "size": {}, "bounds": [{}, {}], "moves": {}, "loads": {}}})",
      json_string(model.name), json_string(file), model.dimension(), model.mesh.nodes.size(),
      body.surface_mesh_nodes().size(), model.mesh.elements(), body.greens().order(),
      json_string(traits(model.mesh.element).name), body.bounds().diagonal().norm(),
      json_vector(body.bounds().min()), json_vector(body.bounds().max()),
      model.dynamics.method != DynamicsMethod::none, has_loads(model));
}

std::string describe_defaults(const Body& body) {
  const double size = body.bounds().diagonal().norm();
  const double radius = std::clamp(body.mean_surface_edge(), 0.03 * size, 0.1 * size);
  return fmt::format(R"({{"radius": {}, "reach": {}, "friction": {}, "depth": {}}})", radius,
                     body.longest_surface_edge(), body.surface_friction().front(), 0.05 * size);
}

}  // namespace palpate
