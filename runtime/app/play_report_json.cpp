// The report of a run for programs.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_text.h"
#include "runtime/app/best_effort_report.h"
#include "runtime/app/play_report.h"
#include "runtime/background/live_motion.h"
#include "runtime/background/two_level_motion.h"
#include "runtime/depth/studied_range.h"
#include "runtime/live/live_model.h"
#include "runtime/loop/last_tick.h"
#include "runtime/loop/output.h"
#include "statics/surface_change.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

/// Largest use of the tick's fixed capacities.
Json json_room(const State& state) {
  const HighWater& most = state.scratch.high_water;
  const auto entry = [](Index used, auto room) { return Json{{"most", used}, {"room", room}}; };
  return {{"near_nodes", entry(most.near_nodes, state.surface.near.capacity())},
          {"contact_points", entry(most.contact_points, state.max_contacts())},
          {"unknowns", entry(most.unknowns, state.scratch.rows.size())},
          {"simplices", entry(most.simplices, state.scratch.detection.pairs.size())}};
}

Json json_tool(const Tool& tool) {
  return {{"radius_m", tool.radius},
          {"length_m", tool.length},
          {"disc_radius_m", tool.disc_radius},
          {"reach_m", tool.reach},
          {"friction", tool.friction ? Json(*tool.friction) : Json()},
          {"coupling_N_per_m", tool.coupling_stiffness},
          {"coupling_torsion_Nm_per_rad", tool.coupling_torsion},
          {"max_force_N", tool.max_force},
          {"hand_over", tool.hand_over}};
}

Json json_overlays(const PatchSource& overlays, const OverlayOptions& options) {
  const PatchCounts& counts = overlays.counts();
  Json json = options.kind == OverlayKind::graded
                  ? Json{{"graded", true}}
                  : Json{{"refinement", options.refinement}, {"rings", options.rings}};
  json.update({{"built", overlays.built()},
               {"failed", overlays.failed()},
               {"longest_build_s", overlays.longest_build()},
               {"bytes", overlays.bytes()},
               {"switches", counts.switches},
               {"ticks_near", counts.ticks},
               {"older_ticks_near", counts.older},
               {"ticks_in_contact", counts.in_contact},
               {"older_ticks_in_contact", counts.older_in_contact}});
  if (overlays.tangents() == nullptr) return json;
  const PatchTangentTelling telling = overlays.tangents()->telling();
  json["neo_hookean"] = {{"made", telling.made},
                         {"failed", telling.failed},
                         {"steps_cut", telling.cuts},
                         {"with_inverted_elements", telling.with_inverted},
                         {"most_inverted", telling.most_inverted},
                         {"last_residual", telling.last_residual},
                         {"longest_s", telling.longest}};
  return json;
}

std::string_view name_of(DynamicsMethod method) {
  if (method == DynamicsMethod::none) return "none";
  return method == DynamicsMethod::packed ? "packed" : "modal";
}

Json json_depth(const DepthTelling& depth) {
  return {{"largest_rotation_deg", degrees_a_radian * depth.largest_rotation},
          {"last_rotation_deg", degrees_a_radian * depth.last_rotation},
          {"compliance_turns", depth.turns},
          {"steps_unbalanced", depth.unbalanced},
          {"small_strain_at_largest_force", depth.small_strain_at_largest},
          {"last_small_strain", depth.last_small_strain},
          {"last_residual", depth.last_residual}};
}

Json json_live(const Body& body, const LiveTelling& live, const LoopReport& report) {
  const LiveCounts& counts = live.counts;
  return {
      {"solver", name_of(body.live()->body.options().law)},
      {"integrator", name_of(body.live()->stepper.scheme.integrator)},
      {"step_s", body.live()->stepper.time_step},
      {"steps", counts.steps},
      {"steps_cut", counts.halved},
      {"steps_stopped", counts.stopped},
      {"steps_with_inverted_elements", counts.inverted},
      {"most_inverted", counts.most_inverted},
      {"plastic_work_J", counts.plastic_work},
      {"compliance_age_s", live.compliance_age},
      {"compliance_renewals", live.renewals},
      {"compliance_turns", live.turns},
      {"largest_error_m", live.largest_error},
      {"last_error_m", live.last_error},
      {"largest_force_error_N", std::max(live.largest_force_error, report.best_effort.largest_late_error)},
      {"last_force_error_N", live.last_force_error},
      {"largest_force_N", live.largest_force}};
}

Json json_dynamics(const Body& body, const MotionSource* motion) {
  const bool is_deep = body.contact_model() == ContactModel::two_level;
  const bool is_dynamic = !is_deep && body.contact_model() != ContactModel::quasi_static;
  Json json = {{"method", body.live() != nullptr ? "live"
                          : is_deep              ? "none"
                                                 : name_of(body.model().dynamics.method)},
               {"contact", is_dynamic ? "dynamic" : "quasi-static"}};
  if (motion != nullptr) {
    json["steps"] = motion->steps();
    json["longest_step_s"] = motion->longest_step();
  }
  return json;
}

/// Counts of durations by class: [upper end in ns, count], each class twice as long as the one before.
Json json_histogram(const TimeHistogram& histogram) {
  Json json = Json::array();
  std::int64_t from = 0;
  for (std::int64_t to = 500; from <= histogram.worst(); to *= 2) {
    json.push_back({to, histogram.total_between(from, to)});
    from = to;
  }
  return json;
}

Json json_times(const TimeHistogram& histogram) {
  return {{"median", histogram.percentile(0.5)},
          {"p99_9", histogram.percentile(0.999)},
          {"p99_99", histogram.percentile(0.9999)},
          {"worst", histogram.worst()},
          {"histogram", json_histogram(histogram)}};
}

Json json_safety(const LoopReport& report) {
  Json faults;
  for (std::size_t k = 1; k < fault_names.size(); ++k) faults[fault_names[k].second] = report.faults[k];
  return {{"largest_shown_N", report.largest_shown}, {"faults", faults}};
}

Json json_surface(const PlayedRun& run) {
  const Body& body = run.body;  // against the mesh, after the last tick
  const SurfaceChange change =
      surface_change(body.dimension(), body.drawn_simplices(), body.surface_in_mesh(),
                     displacement_from_mesh(body, run.state));
  const std::optional<double> studied = studied_rotation(body);
  return {{"last_rotation_deg", degrees_a_radian * change.rotation},
          {"last_strain", change.strain},
          {"studied_rotation_deg", studied ? Json(degrees_a_radian * *studied) : Json()}};
}

Json json_device(const PlayedRun& run) {
  Json json = {{"name", run.options.device.text}};
  if (run.link != nullptr) {
    json["description"] = run.link->name();
    json["reports"] = run.link->reports();
    json["writes"] = run.link->writes();
    json["worst_write_ns"] = run.link->worst_write();
    json["writes_without_loop"] = run.link->extrapolated();
    json["opened_again"] = run.report.opened_again;
    json["refused"] = run.link->refusals();
  }
  return json;
}

Json json_parts(const PlayedParts& parts) {
  Json rows = Json::array();
  for (const auto& row : parts.rows()) {
    const std::string recording = row.part.recording.string();
    rows.push_back({{"because", row.part.because},
                    {"begun_s", row.begun},
                    {"sessions", row.sessions},
                    {"settings", row.part.settings},
                    {"recording", recording.empty() ? Json() : Json(recording)},
                    {"dropped_ticks", row.part.dropped},
                    {"ticks", row.ticks},
                    {"ticks_in_contact", row.ticks_in_contact},
                    {"deadline_misses", row.misses},
                    {"faults", row.faults},
                    {"largest_force_N", row.largest_force},
                    {"largest_shown_N", row.largest_shown}});
  }
  return rows;
}

Json json_replay(const ReplayDifference& replay) {
  const bool differs = replay.first_tick >= 0;
  return {{"ticks", replay.ticks},
          {"different_ticks", replay.different},
          {"largest_difference_N", replay.largest},
          {"first_different_tick", differs ? Json(replay.first_tick) : Json()},
          {"first_different_field", differs ? Json(replay.first_field) : Json()}};
}

}  // namespace

std::string json_report(const PlayedRun& run) {
  const LoopReport& report = run.report;
  Json status;
  for (std::size_t k = 0; k < status_names.size(); ++k)
    status[status_names[k].second] = report.status_ticks[k];
  Json json = {{"generator", "palpate-runtime " PALPATE_VERSION},
               {"file", run.options.file.string()},
               {"model", run.body.model().name},
               {"fast", run.options.fast},
               {"interrupted", report.interrupted},
               {"tool", json_tool(run.tool)},
               {"ticks", report.ticks},
               {"ticks_in_contact", report.ticks_in_contact},
               {"ticks_begun_inside", report.ticks_begun_inside},
               {"most_contacts", report.most_contacts},
               {"rate_Hz", report.rate},
               {"deadline_misses", report.deadline_misses}};
  if (!run.options.fast) json["lateness_ns"] = json_times(report.lateness);
  json["compute_ns"] = json_times(report.compute);
  json["largest_force_N"] = report.largest_force;
  json["largest_force_time_s"] = report.largest_force_time;
  json["largest_force_depth_m"] = report.largest_force_depth;
  json["largest_force_mesh_stiffening"] = report.largest_force_stiffening;
  json["largest_jump_N"] = report.largest_jump;
  json["largest_jump_time_s"] = report.largest_jump_time;
  if (report.largest_greens_error > 0.0) {
    json["largest_greens_error_N"] = report.largest_greens_error;
    json["largest_greens_error_time_s"] = report.largest_greens_error_time;
  }
  json["status_ticks"] = status;
  json["best_effort"] = to_json(report.best_effort);
  json["room"] = json_room(run.state);
  json["surface"] = json_surface(run);
  json["device"] = json_device(run);
  if (run.settings.safety) json["safety"] = json_safety(report);
  if (run.options.device.kind == DeviceChoice::Kind::replay) json["replay"] = json_replay(report.replay);
  if (run.overlays != nullptr) json["overlay"] = json_overlays(*run.overlays, run.settings.overlay);
  json["dynamics"] = json_dynamics(run.body, run.motion);
  if (const LiveMotion* live = run.live()) json["live"] = json_live(run.body, live->telling(), run.report);
  if (const TwoLevelMotion* deep = run.deep()) json["depth"] = json_depth(deep->telling());
  if (!run.options.record.empty()) {
    json["recording"] = run.options.record.string();
    json["recording_failed"] = run.recording_failure ? Json(in_one_line(*run.recording_failure)) : Json();
  }
  json["dropped_ticks"] = run.dropped;
  if (run.parts != nullptr) json["parts"] = json_parts(*run.parts);
  return json_text(json, 2);
}

}  // namespace palpate
