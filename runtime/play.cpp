#include "runtime/play.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <span>

#include "meshes/error.h"
#include "meshes/vtu_writer.h"
#include "runtime/loading.h"
#include "runtime/loop.h"
#include "runtime/output.h"
#include "runtime/real_time.h"
#include "runtime/surface_frames.h"

namespace palpate {
namespace {

std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free, "it is set by a signal handler");

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_asked = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

void print_loaded(const Body& body, double seconds) {
  fmt::print(stderr, "{}: {} free surface nodes, {} dofs in {} precision, loaded in {:.2f} s\n",
             body.model().name, body.free_surface_nodes().size(), body.greens().order(),
             body.greens().precision() == Precision::single_precision ? "single" : "double", seconds);
  if (!body.greens().unfolded()) {
    print_warning(
        "the Green's functions do not fit into half of the free memory as a full square; used packed, which "
        "is slower");
  }
}

double microseconds(std::int64_t nanoseconds) {
  return static_cast<double>(nanoseconds) * 1e-3;
}

void print_overlays(const PatchSource& overlays) {
  const PatchCounts& counts = overlays.counts();
  const auto in_contact = static_cast<double>(std::max<std::int64_t>(counts.in_contact, 1));
  fmt::print(
      stderr,
      "overlay: {} patches built (longest {:.1f} ms, {:.0f} MB kept), {} switches, {:.2f} % of the ticks in "
      "contact on an older patch or none\n",
      overlays.built(), 1e3 * overlays.longest_build(), 1e-6 * static_cast<double>(overlays.bytes()),
      counts.switches, 100.0 * static_cast<double>(counts.older_in_contact) / in_contact);
  if (overlays.failed() > 0)
    print_warning(
        fmt::format("{} overlays could not be made: the elements there are too flat, or those of the file do "
                    "not belong to its mesh (precompute it again)",
                    overlays.failed()));
}

void print_report(const LoopReport& report, const PlayOptions& options, std::int64_t dropped,
                  std::int64_t dropped_frames) {
  fmt::print(stderr, "{} ticks{}, {} of them in contact, at most {} contact points", report.ticks,
             report.interrupted ? " until interrupted" : "", report.ticks_in_contact, report.most_contacts);
  if (!options.fast) {
    fmt::print(stderr, "; {} deadline misses, at most {:.1f} us late", report.deadline_misses,
               microseconds(report.worst_lateness));
  }
  fmt::print(stderr, "\nstep: median {:.2f} us, 99.9 % {:.2f} us, worst {:.2f} us\n",
             microseconds(report.compute.percentile(0.5)), microseconds(report.compute.percentile(0.999)),
             microseconds(report.compute.worst()));
  fmt::print(stderr, "largest force {:.6g} N at {:.3f} s, largest jump between ticks {:.6g} N at {:.3f} s\n",
             report.largest_force, report.largest_force_time, report.largest_jump, report.largest_jump_time);
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    if (report.status_ticks[k] > 0)
      fmt::print(stderr, "{}: {} ticks\n", status_names[k].second, report.status_ticks[k]);
  }
  if (!options.record.empty())
    fmt::print(stderr, "recording {}: {} ticks and {} frames dropped\n", options.record.string(), dropped,
               dropped_frames);
}

std::string box_text(const Body& body) {
  Eigen::AlignedBox3d box;
  for (const Vec3& position : body.surface_rest_positions()) box.extend(position);
  const Vec3 low = box.min();
  const Vec3 high = box.max();
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) m", low.x(), low.y(), low.z(),
                     high.x(), high.y(), high.z());
}

/// What a script gets wrong so that nothing is felt.
void warn_of_script(const LoopReport& report, const Body& body) {
  const std::string place = "the body rests in " + box_text(body);
  if (report.ticks_begun_inside > 0) {
    const bool all = report.ticks_begun_inside == report.ticks;
    const double seconds = static_cast<double>(report.ticks_begun_inside) / ticks_per_second;
    print_warning(fmt::format("the tool began inside the body and felt nothing {}: start outside ({})",
                              all ? "at all" : fmt::format("until it was out at {} s", seconds), place));
  } else if (report.ticks_in_contact == 0) {
    print_warning(fmt::format(
        "the tool never touched the body: check the script's positions, which are metres, and the "
        "tool's size ({})",
        place));
  }
}

/// JSON knows no infinity.
std::string json_number(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : "null";
}

std::string json_tool(const Tool& tool) {
  return fmt::format(
      "{{\"radius_m\": {}, \"length_m\": {}, \"reach_m\": {}, \"friction\": {}, \"coupling_N_per_m\": {}, "
      "\"coupling_torsion_Nm_per_rad\": {}, \"max_force_N\": {}, \"hand_over\": {}}}",
      tool.radius, tool.length, tool.reach, tool.friction ? json_number(*tool.friction) : "null",
      json_number(tool.coupling_stiffness), json_number(tool.coupling_torsion), json_number(tool.max_force),
      json_number(tool.hand_over));
}

std::string json_overlays(const PatchSource& overlays, const OverlayOptions& options) {
  const PatchCounts& counts = overlays.counts();
  return fmt::format(
      "{{\"refinement\": {}, \"rings\": {}, \"built\": {}, \"failed\": {}, \"longest_build_s\": {}, "
      "\"bytes\": {}, "
      "\"switches\": {}, \"ticks_near\": {}, \"older_ticks_near\": {}, \"ticks_in_contact\": {}, "
      "\"older_ticks_in_contact\": {}}}",
      options.refinement, options.rings, overlays.built(), overlays.failed(), overlays.longest_build(),
      overlays.bytes(), counts.switches, counts.ticks, counts.older, counts.in_contact,
      counts.older_in_contact);
}

std::string_view name_of(DynamicsMethod method) {
  if (method == DynamicsMethod::none) return "none";
  return method == DynamicsMethod::packed ? "packed" : "modal";
}

std::string json_dynamics(const Body& body, const MotionSource* motion) {
  const StoredDynamics& dynamics = body.model().dynamics;
  std::string json = fmt::format("{{\"method\": \"{}\", \"contact\": \"{}\"", name_of(dynamics.method),
                                 body.contact_model() == ContactModel::dynamic ? "dynamic" : "quasi-static");
  if (motion != nullptr)
    json += fmt::format(", \"steps\": {}, \"longest_step_s\": {}", motion->steps(), motion->longest_step());
  return json + "}";
}

std::string json_report(const LoopReport& report, const PlayOptions& options, const Body& body,
                        const Tool& tool, const PatchSource* overlays, const MotionSource* motion,
                        std::int64_t dropped) {
  std::string status;
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    status += fmt::format("{}\"{}\": {}", k == 0 ? "" : ", ", status_names[k].second, report.status_ticks[k]);
  }
  std::string json = "{\n";
  json += fmt::format("  \"file\": {},\n  \"model\": {},\n", json_string(options.file.string()),
                      json_string(body.model().name));
  json += fmt::format("  \"fast\": {},\n  \"interrupted\": {},\n  \"tool\": {},\n", options.fast,
                      report.interrupted, json_tool(tool));
  json += fmt::format("  \"ticks\": {},\n  \"ticks_in_contact\": {},\n  \"ticks_begun_inside\": {},\n",
                      report.ticks, report.ticks_in_contact, report.ticks_begun_inside);
  json += fmt::format("  \"most_contacts\": {},\n", report.most_contacts);
  json += fmt::format("  \"deadline_misses\": {},\n  \"worst_lateness_ns\": {},\n", report.deadline_misses,
                      report.worst_lateness);
  json +=
      fmt::format("  \"compute_ns\": {{\"median\": {}, \"p99_9\": {}, \"worst\": {}}},\n",
                  report.compute.percentile(0.5), report.compute.percentile(0.999), report.compute.worst());
  json += fmt::format("  \"largest_force_N\": {},\n  \"largest_force_time_s\": {},\n", report.largest_force,
                      report.largest_force_time);
  json += fmt::format("  \"largest_jump_N\": {},\n  \"largest_jump_time_s\": {},\n", report.largest_jump,
                      report.largest_jump_time);
  json += fmt::format("  \"status_ticks\": {{{}}},\n", status);
  if (overlays != nullptr)
    json += fmt::format("  \"overlay\": {},\n", json_overlays(*overlays, options.overlay.value()));
  json += fmt::format("  \"dynamics\": {},\n", json_dynamics(body, motion));
  if (!options.record.empty())
    json += fmt::format("  \"recording\": {},\n", json_string(options.record.string()));
  json += fmt::format("  \"dropped_ticks\": {}\n}}\n", dropped);
  return json;
}

/// Where the surface is now at a contact.
Vec3 surface_position(const State& state, const ContactPoint& contact) {
  Vec3 position = Vec3::Zero();
  for (std::size_t k = 0; k < contact.nodes.size(); ++k) {
    if (contact.nodes[k] >= 0) position += contact.weights[k] * state.tree.position(contact.nodes[k]);
  }
  return position;
}

/// Of a simplex as it is now.
Vec3 outward_normal(const Body& body, const State& state, Index simplex) {
  const auto d = static_cast<std::size_t>(body.dimension());
  const std::span<const Index> nodes = body.simplices().subspan(d * static_cast<std::size_t>(simplex), d);
  const Vec3 a = state.tree.position(nodes[0]);
  const Vec3 ab = state.tree.position(nodes[1]) - a;
  if (d == 2) return Vec3(ab.y(), -ab.x(), 0.0).normalized();
  return ab.cross(state.tree.position(nodes[2]) - a).normalized();
}

/// The gap that the tick left, to first order: the contact's normal row of r = b + W lambda.
double gap_after(const ContactProblem& problem, Index contact) {
  const Index normal = problem.first_row(contact);
  double gap = problem.b[static_cast<std::size_t>(normal)];
  for (Index j = 0; j < problem.rows; ++j)
    gap += problem.w(normal, j) * problem.lambda[static_cast<std::size_t>(j)];
  return gap;
}

/// The contact points after the last tick.
std::string contact_table(const Body& body, const State& state) {
  std::string table = "x,y,z,nx,ny,nz,fx,fy,fz,gap,simplex,held\n";
  const std::span<const ContactPoint> contacts = state.contacts();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactPoint& contact = contacts[k];
    const Vec3 x = surface_position(state, contact);
    const Vec3 n = contact.held ? outward_normal(body, state, contact.simplex) : Vec3(contact.frame.col(0));
    const Vec3 f = Vec3::Zero() - contact.force;
    const double gap = contact.held ? 0.0 : gap_after(state.problem, static_cast<Index>(k));
    table += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", x.x(), x.y(), x.z(), n.x(), n.y(), n.z(),
                         f.x(), f.y(), f.z(), gap, contact.simplex, contact.held ? 1 : 0);
  }
  return table;
}

/// The surface after the last tick, undeformed, with u0 + u, which is what is seen.
void write_surface(const std::filesystem::path& file, const Body& body, const State& state) {
  std::vector<double> stored(static_cast<std::size_t>(body.greens().order()));
  std::vector<Vec3> u(body.surface_rest_positions().size());
  ShownMotion motion(body);
  state.motion.show(motion);
  surface_displacement(body, state.near.load(), stored, u, &motion);
  const std::vector<Vec3> nodes = body.surface_in_mesh();
  std::vector<double> total;
  for (std::size_t node = 0; node < u.size(); ++node) {
    const Vec3 seen = body.surface_rest_positions()[node] + u[node] - nodes[node];
    total.insert(total.end(), seen.begin(), seen.end());
  }
  const std::vector<NodalField> fields = {{"displacement", 3, total}};
  write_vtu(file, nodes, body.dimension() == 3 ? ElementType::tri3 : ElementType::line2, body.simplices(),
            fields);
}

/// The loop with the rights it needs, which the threads that were started before do not inherit.
LoopReport run(const Body& body, State& state, const ScriptDevice& device, PatchSource* overlays,
               MotionSource* motion, Recorder* recorder, SurfaceFrames* frames, bool fast) {
  if (fast) return run_loop(body, state, device, overlays, motion, recorder, fast, stop_asked, frames);
  const RealTimeRights rights;
  if (!rights.refused().empty()) print_warning(rights.refused());
  return run_loop(body, state, device, overlays, motion, recorder, fast, stop_asked, frames);
}

SessionInfo session_info(const PlayOptions& options, const Body& body, const Tool& tool) {
  std::string text = fmt::format("tool_radius={}\ntool_length={}\nreach={}\nhand_over={}\n", tool.radius,
                                 tool.length, tool.reach, tool.hand_over);
  if (tool.friction) text += fmt::format("friction={}\n", *tool.friction);
  text += fmt::format("coupling={}\ncoupling_torsion={}\nmax_force={}\n", tool.coupling_stiffness,
                      tool.coupling_torsion, tool.max_force);
  text += fmt::format("max_contacts={}\ncontact={}\nfast={}\n", options.max_contacts,
                      options.contact == ContactModel::dynamic ? "dynamic" : "quasi-static", options.fast);
  if (options.overlay)
    text += fmt::format("overlay=r={},rings={}\n", options.overlay->refinement, options.overlay->rings);
  return {.model = options.file.string(),
          .content_hash = body.model().content_hash,
          .device = "script:" + options.script.string(),
          .rate = ticks_per_second,
          .options = text};
}

/// Every how many ticks, for so many frames a second.
std::int64_t ticks_per_frame(double frames_per_second) {
  return std::max<std::int64_t>(std::llround(ticks_per_second / frames_per_second), 1);
}

}  // namespace

int play(const PlayOptions& options) {
  const ScriptDevice device = ScriptDevice::read(options.script);
  const auto start = std::chrono::steady_clock::now();
  const Body body = load_body(options.file, options.model_toml,
                              options.overlay ? options.overlay->refinement : 1, options.contact);
  print_loaded(body, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());

  Tool tool = options.tool;
  tool.reach = options.reach.value_or(body.longest_surface_edge());
  State state(body, {.tools = {tool},
                     .max_contacts = options.max_contacts,
                     .patch_nodes = options.overlay ? patch_room(body, options.overlay->rings, 1) : 0});
  std::optional<PatchSource> overlays;
  if (options.overlay) {
    overlays.emplace(body, state,
                     PatchSourceOptions{.rings = options.overlay->rings,
                                        .memory = options.overlay_memory,
                                        .in_background = !options.fast});
  }
  PatchSource* const source = overlays ? &*overlays : nullptr;
  std::optional<MotionSource> motion;
  if (body.model().dynamics.method == DynamicsMethod::packed)
    motion.emplace(body, state, MotionSourceOptions{.in_background = !options.fast});
  std::optional<Recorder> recorder;
  std::optional<SurfaceFrames> frames;
  if (!options.record.empty()) {
    recorder.emplace(options.record, session_info(options, body, tool), recorded_surface(body));
    if (options.record_frames > 0.0)
      frames.emplace(body, state,
                     SurfaceFramesOptions{.ticks_per_frame = ticks_per_frame(options.record_frames),
                                          .in_background = !options.fast},
                     [&recorder, fast = options.fast](SurfaceFrame frame) {
                       if (fast) {
                         recorder->push_frame_waiting(std::move(frame));
                       } else {
                         recorder->push_frame(std::move(frame));
                       }
                     });
  }

  stop_on_signals();
  const LoopReport report = run(body, state, device, source, motion ? &*motion : nullptr,
                                recorder ? &*recorder : nullptr, frames ? &*frames : nullptr, options.fast);
  frames.reset();  // the last frame is in the recording
  if (recorder) recorder->finish();

  const std::int64_t dropped = recorder ? recorder->dropped() : 0;
  print_report(report, options, dropped, recorder ? recorder->dropped_frames() : 0);
  if (source != nullptr) print_overlays(*source);
  if (motion) {
    fmt::print(stderr, "motion: {} steps of {:.3g} ms, longest {:.2f} ms\n", motion->steps(),
               1e3 * body.model().dynamics.newmark.time_step, 1e3 * motion->longest_step());
  }
  warn_of_script(report, body);
  if (!options.contacts.empty()) write_text_file(options.contacts, contact_table(body, state));
  if (!options.surface.empty()) write_surface(options.surface, body, state);
  const std::string json =
      json_report(report, options, body, tool, source, motion ? &*motion : nullptr, dropped);
  if (options.report.empty()) {
    fmt::print("{}", json);
  } else {
    write_text_file(options.report, json);
  }
  return report.interrupted ? exit_interrupted : exit_ok;
}

}  // namespace palpate
