#include "runtime/app/play_session.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "base/error.h"
#include "base/write_file.h"
#include "runtime/app/play_report.h"
#include "runtime/background/live_motion.h"
#include "runtime/loop/last_tick.h"
#include "runtime/loop/output.h"
#include "runtime/loop/real_time.h"
#include "runtime/loop/session_check.h"

namespace palpate {
namespace {

constexpr double views_a_second = 60.0;

Tool tool_of(const Settings& settings, const Body& body) {
  Tool tool = settings.tool;
  tool.reach = settings.reach.value_or(body.longest_surface_edge());
  return tool;
}

bool has_patches(const Settings& settings, const Body& body) {
  return body.refinement() > 1 && settings.overlay.has_patches();
}

State state_of(const Settings& settings, const Body& body, const Tool& tool) {
  return State(body,
               {.tools = {tool},
                .max_contacts = settings.max_contacts,
                .patch_nodes = has_patches(settings, body) ? patch_room(body, settings.overlay.rings, 1) : 0,
                .tick = 1.0 / static_cast<double>(settings.rate)});
}

void warn_of_slow_steps(const Body& body) {
  const double step = body.live()->stepper.time_step, taken = measured_step(body);
  if (taken <= step) return;
  print_warning(fmt::format(
      "a step of {:.3g} ms takes {:.0f} ms here: the body moves {:.2g} times slower than real time and feels "
      "stiffer than it is; give it a larger edge_length, a longer --live-step or --step-solver cg, leave out "
      "--solver (or take --depth yes), or let it take its time by --fast",
      1e3 * step, 1e3 * taken, taken / step));
}

}  // namespace

PlaySession::PlaySession(PlayOptions options, const Body& body, const InputSource& input,
                         const SessionViewer& viewer)
    : body_(body),
      input_(input),
      control_(viewer.control),
      tool_(tool_of(options.settings, body)),
      options_(std::move(options)),
      state_(state_of(options_.settings, body, tool_)) {
  Settings& settings = options_.settings;
  if (settings.safety) {
    settings.safety->period = 1.0 / static_cast<double>(settings.rate);
    safety_.emplace(*settings.safety);
  }
  const bool in_background = !options_.fast && !options_.session;
  if (has_patches(settings, body)) {
    if (options_.session) check_overlays(*options_.session, body);
    overlays_.emplace(body, state_,
                      PatchSourceOptions{.rings = settings.overlay.rings,
                                         .finest = settings.finest(),
                                         .law = settings.overlay_law,
                                         .memory = settings.overlay_memory,
                                         .in_background = in_background});
  }
  if (body.swing().method == DynamicsMethod::packed)
    motion_.emplace(body, state_, MotionSourceOptions{.in_background = in_background});
  if (body.live() != nullptr && in_background) warn_of_slow_steps(body);
  if (!options_.record.empty()) {
    recorder_.emplace(
        options_.record,
        SessionInfo{.model_path = options_.file.string(),
                    .content_hash = body.model().content_hash,
                    .device = options_.device.text,
                    .rate = settings.rate,
                    .options = to_text(settings)},
        recorded_surface(body), [tell_viewer = viewer.recording_failed](const Error& reason) {
          print_warning("the recording failed, and the run goes on without it: " + in_one_line(reason));
          if (tell_viewer) tell_viewer(reason);
        });
  }
  if (recorder_ && options_.record_frames > 0.0) {
    const bool contacts_only = !overlays_ && pictures_follow_from_contacts(body);
    frames_.emplace(
        body, state_,
        SurfaceFramesOptions{.ticks_per_frame = ticks_per_frame(settings.rate, options_.record_frames),
                             .in_background = !options_.fast,
                             .contacts_only = contacts_only},
        [this, contacts_only, fast = options_.fast](SurfacePicture picture) {
          keep_recorded(body_, picture.frame);
          RecordedPicture recorded = contacts_only ? RecordedPicture(std::move(picture.loads))
                                                   : RecordedPicture(std::move(picture.frame));
          if (fast) {
            recorder_->push_picture_waiting(std::move(recorded));
          } else {
            recorder_->push_picture(std::move(recorded));
          }
        });
  }
  if (viewer.pictures)
    viewed_.emplace(body, state_, SurfaceFramesOptions{.ticks_per_frame = 1}, viewer.pictures);
  if (viewer.ticks) feed_.emplace(viewer.ticks);
  if (!options_.fast) {
    monitor_.emplace(MonitorOptions{.rate = settings.rate,
                                    .line = isatty(STDERR_FILENO) != 0,
                                    .acknowledges = input.link != nullptr,
                                    .shows_safety = safety_.has_value()});
  }
}

const LoopReport& PlaySession::run(const std::atomic<bool>& stop) {
  report_ = run_with_rights(stop);
  monitor_.reset();
  feed_.reset();
  viewed_.reset();
  frames_.reset();  // waits until the last frame is in the recording
  if (recorder_) finish_recording();
  if (input_.replay != nullptr) input_.replay->check();
  return report_;
}

void PlaySession::finish_recording() {
  try {
    recorder_->finish();
  } catch (const std::exception&) {
    recording_failure_ = handled_error("", "close other programs");
  }
}

/// Runs the loop with its real-time rights, which threads started earlier do not inherit.
LoopReport PlaySession::run_with_rights(const std::atomic<bool>& stop) {
  const auto pointer = [](auto& part) { return part ? &*part : nullptr; };
  const LoopParts parts = {.body = body_,
                           .state = state_,
                           .device = *input_.device,
                           .workspace = Workspace(options_.settings.workspace()),
                           .safety = pointer(safety_),
                           .overlays = pointer(overlays_),
                           .motion = pointer(motion_),
                           .recorder = pointer(recorder_),
                           .monitor = pointer(monitor_),
                           .frames = pointer(frames_),
                           .control = control_,
                           .feed = pointer(feed_),
                           .viewed = pointer(viewed_),
                           .replayed = input_.replay};
  const LoopOptions loop = {.rate = options_.settings.rate,
                            .ticks = input_.ticks,
                            .fast = options_.fast,
                            .ticks_per_view = ticks_per_frame(options_.settings.rate, views_a_second)};
  if (options_.fast) return run_loop(parts, loop, stop);
  const RealTimeRights rights(options_.processor);
  if (!rights.refused().empty()) print_warning(rights.refused());
  return run_loop(parts, loop, stop);
}

void PlaySession::tell(const PlayedParts* parts) const {
  const PlayedRun played{.options = options_,
                         .settings = options_.settings,
                         .body = body_,
                         .tool = tool_,
                         .state = state_,
                         .report = parts != nullptr ? parts->report() : report_,
                         .parts = parts,
                         .overlays = overlays_ ? &*overlays_ : nullptr,
                         .motion = motion_ ? &*motion_ : nullptr,
                         .link = input_.link,
                         .dropped = parts != nullptr ? parts->dropped() : dropped(),
                         .dropped_frames = recorder_ ? recorder_->dropped_pictures() : 0,
                         .recording_failure = recording_failure_};
  print_report(played);
  std::optional<Error> first;
  const auto attempt = [&first](const std::filesystem::path& file, auto&& write) {
    if (file.empty()) return;
    try {
      write(file);
    } catch (const Error& error) {
      if (first) {
        print_warning(in_one_line(error));
      } else {
        first = error;
      }
    }
  };
  attempt(options_.contacts, [&](const auto& file) { write_file(file, contact_table(body_, state_)); });
  attempt(options_.surface, [&](const auto& file) { write_surface(file, body_, state_); });
  attempt(options_.report, [&](const auto& file) {
    if (file == standard_output) {
      std::fputs(json_report(played).c_str(), stdout);  // main checks whether it was written
    } else {
      write_file(file, json_report(played));
    }
  });
  if (first) throw Error(*first);
}

}  // namespace palpate
