#include "runtime/play.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <limits>
#include <thread>

#include "meshes/error.h"
#include "runtime/devices/device_link.h"
#include "runtime/last_tick.h"
#include "runtime/loading.h"
#include "runtime/loop.h"
#include "runtime/open_device.h"
#include "runtime/output.h"
#include "runtime/play_report.h"
#include "runtime/real_time.h"
#include "runtime/script_device.h"
#include "runtime/surface_frames.h"

namespace palpate {
namespace {

std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free, "it is set by a signal handler");

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_asked = true; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
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

Body load(const PlayOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const Settings& settings = options.settings;
  Body body = load_body(options.file, options.model_toml, settings.overlay ? settings.overlay->refinement : 1,
                        settings.contact);
  print_loaded(body, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return body;
}

/// What moves the tool.
struct Mover {
  std::unique_ptr<Device> device;
  DeviceLink* link = nullptr;  ///< the device, where a hand may be in it
  std::int64_t ticks = std::numeric_limits<std::int32_t>::max();
};

Mover make_mover(const PlayOptions& options, Guardian* guardian) {
  Mover mover;
  if (options.device.kind == DeviceChoice::Kind::script) {
    auto script = std::make_unique<ScriptDevice>(ScriptDevice::read(options.device.target));
    script->set_rate(options.settings.rate);
    mover.ticks = script->ticks();
    mover.device = std::move(script);
  } else if (options.device.kind == DeviceChoice::Kind::replay) {
    auto replay = std::make_unique<ReplayDevice>(*options.session);
    mover.ticks = replay->ticks();
    mover.device = std::move(replay);
  } else {
    const SafetyOptions safety = options.settings.safety.value_or(SafetyOptions{});
    auto link = std::make_unique<DeviceLink>(
        make_port(options.device, safety, guardian),
        DeviceLinkOptions{
            .max_force = safety.max_force, .max_force_rate = safety.max_force_rate, .stale = safety.stale});
    mover.link = link.get();
    mover.device = std::move(link);
  }
  if (options.duration) {
    const double ticks = std::ceil(*options.duration * static_cast<double>(options.settings.rate));
    mover.ticks = std::min(mover.ticks, static_cast<std::int64_t>(std::min(ticks, 1e15)));
  }
  return mover;
}

/// Until the device says where it is.
void wait_for(const DeviceLink& link, bool is_bridge) {
  using namespace std::chrono_literals;
  const auto start = std::chrono::steady_clock::now();
  bool told = false;
  std::string refusals;
  while (!link.has_reported() && !stop_asked) {
    const auto waited = std::chrono::steady_clock::now() - start;
    if (!told && waited > 300ms) {
      fmt::print(stderr, "waiting for {}\n", link.name());
      told = true;
    }
    // Something speaks, but not as it should.
    if (refusals.empty() && !(refusals = link.refusals()).empty()) print_warning("refused: " + refusals);
    if (!is_bridge && waited > 5s) {
      throw Error("it was opened but says nothing", link.name(),
                  "plug it out and in again, see that it is calibrated and no other program uses it");
    }
    std::this_thread::sleep_for(5ms);
  }
}

/// Where the device's origin lies unless it is said: above the body, so that half of the workspace's radius
/// takes the tool down to it.
Vec3 place_above(const Body& body, const Tool& tool, double radius, double motion_scale) {
  constexpr double usual_radius = 0.1;  // m
  const double reach = motion_scale * (std::isfinite(radius) ? radius : usual_radius);
  const int up = body.dimension() - 1;
  Vec3 place = body.bounds().center();
  place[up] = body.bounds().max()[up] + tool.radius + 0.5 * reach;
  return place;
}

/// What a hand needs beside what was asked for: safety, a place, and a coupling no stiffer than the device
/// can show.
Settings settle(Settings settings, const DeviceLimits& limits, const Body& body) {
  if (!settings.safety) {
    settings.safety.emplace();
    // A body that swings gives energy back that nobody made.
    if (body.model().dynamics.method != DynamicsMethod::none) settings.safety->max_damping = 0.0;
  }
  *settings.safety = limited(*settings.safety, limits);
  settings.tool.coupling_stiffness =
      std::min(settings.tool.coupling_stiffness,
               settings.safety->max_stiffness / (settings.motion_scale * settings.force_scale));
  if (!settings.origin)
    settings.origin = place_above(body, settings.tool, limits.workspace_radius, settings.motion_scale);
  return settings;
}

void print_device(const DeviceLink& link, const Settings& settings) {
  const Vec3& at = *settings.origin;
  fmt::print(
      stderr,
      "device: {}; its origin lies at ({:.4g}, {:.4g}, {:.4g}) m, axes along {}; motion x {:g}, force x "
      "{:g}; at most {:g} N and, by the coupling, {:g} N/m on the body's side\n",
      link.name(), at.x(), at.y(), at.z(), settings.axes, settings.motion_scale, settings.force_scale,
      settings.safety->max_force, settings.tool.coupling_stiffness);
}

/// The loop with the rights it needs, which the threads that were started before do not inherit.
LoopReport run(const LoopParts& parts, const LoopOptions& options, std::optional<int> processor) {
  if (options.fast) return run_loop(parts, options, stop_asked);
  const RealTimeRights rights(processor);
  if (!rights.refused().empty()) print_warning(rights.refused());
  return run_loop(parts, options, stop_asked);
}

void warn_of_other_model(const Recording& session, const Body& body) {
  if (session.info.content_hash == body.model().content_hash) return;
  print_warning("the session was recorded with another model or another precomputation of it (" +
                session.info.model_path + "): forces will differ");
}

}  // namespace

int play(const PlayOptions& options) {
  std::optional<Guardian> guardian;  // forks, so it comes before the first thread
  if (options.device.kind == DeviceChoice::Kind::hid) guardian.emplace();
  stop_on_signals();
  if (options.processor) leave_to_the_loop(*options.processor);
  const Mover mover = make_mover(options, guardian ? &*guardian : nullptr);
  const Body body = load(options);
  if (options.session) warn_of_other_model(*options.session, body);

  Settings settings = options.settings;
  if (mover.link != nullptr) {
    wait_for(*mover.link, options.device.kind == DeviceChoice::Kind::bridge);
    settings = settle(settings, mover.link->limits(), body);
    print_device(*mover.link, settings);
  }
  std::optional<Safety> safety;
  if (settings.safety) {
    settings.safety->period = 1.0 / static_cast<double>(settings.rate);
    safety.emplace(*settings.safety);
  }

  Tool tool = settings.tool;
  tool.reach = settings.reach.value_or(body.longest_surface_edge());
  State state(body, {.tools = {tool},
                     .max_contacts = settings.max_contacts,
                     .patch_nodes = settings.overlay ? patch_room(body, settings.overlay->rings, 1) : 0,
                     .tick = 1.0 / static_cast<double>(settings.rate)});
  const bool in_background = !options.fast && !options.session;
  std::optional<PatchSource> overlays;
  if (settings.overlay) {
    overlays.emplace(body, state,
                     PatchSourceOptions{.rings = settings.overlay->rings,
                                        .memory = settings.overlay_memory,
                                        .in_background = in_background});
  }
  std::optional<MotionSource> motion;
  if (body.model().dynamics.method == DynamicsMethod::packed)
    motion.emplace(body, state, MotionSourceOptions{.in_background = in_background});
  std::optional<Recorder> recorder;
  if (!options.record.empty()) {
    recorder.emplace(options.record,
                     SessionInfo{.model_path = options.file.string(),
                                 .content_hash = body.model().content_hash,
                                 .device = options.device.text,
                                 .rate = settings.rate,
                                 .options = to_text(settings)},
                     recorded_surface(body));
  }
  std::optional<SurfaceFrames> frames;
  if (recorder && options.record_frames > 0.0) {
    const double ticks = static_cast<double>(settings.rate) / options.record_frames;
    frames.emplace(body, state,
                   SurfaceFramesOptions{
                       .ticks_per_frame = std::max<std::int64_t>(std::llround(std::min(ticks, 1e15)), 1),
                       .in_background = !options.fast},
                   [&recorder, fast = options.fast](SurfacePicture picture) {
                     if (fast) {
                       recorder->push_frame_waiting(std::move(picture.frame));
                     } else {
                       recorder->push_frame(std::move(picture.frame));
                     }
                   });
  }
  std::optional<Monitor> monitor;
  if (!options.fast) {
    monitor.emplace(MonitorOptions{.rate = settings.rate,
                                   .line = isatty(STDERR_FILENO) != 0,
                                   .acknowledges = mover.link != nullptr,
                                   .shows_safety = safety.has_value()});
  }

  const LoopReport report =
      run({.body = body,
           .state = state,
           .device = *mover.device,
           .workspace = Workspace(settings.workspace()),
           .safety = safety ? &*safety : nullptr,
           .overlays = overlays ? &*overlays : nullptr,
           .motion = motion ? &*motion : nullptr,
           .recorder = recorder ? &*recorder : nullptr,
           .monitor = monitor ? &*monitor : nullptr,
           .frames = frames ? &*frames : nullptr,
           .replayed = options.session.get()},
          {.rate = settings.rate, .ticks = mover.ticks, .fast = options.fast}, options.processor);
  monitor.reset();
  frames.reset();  // the last frame is in the recording
  if (recorder) recorder->finish();

  const PlayedRun played{.options = options,
                         .settings = settings,
                         .body = body,
                         .tool = tool,
                         .report = report,
                         .overlays = overlays ? &*overlays : nullptr,
                         .motion = motion ? &*motion : nullptr,
                         .link = mover.link,
                         .dropped = recorder ? recorder->dropped() : 0,
                         .dropped_frames = recorder ? recorder->dropped_frames() : 0};
  print_report(played);
  if (!options.contacts.empty()) write_text_file(options.contacts, contact_table(body, state));
  if (!options.surface.empty()) write_surface(options.surface, body, state);
  const std::string json = json_report(played);
  if (options.report.empty()) {
    fmt::print("{}", json);
  } else {
    write_text_file(options.report, json);
  }
  if (report.interrupted) return exit_interrupted;
  return report.replay.different > 0 ? exit_differs : exit_ok;
}

}  // namespace palpate
