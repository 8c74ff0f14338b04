#include <fmt/core.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/interrupt.h"
#include "base/program.h"
#include "formats/outputs/output_paths.h"
#include "runtime/app/fitting_tool.h"
#include "runtime/app/input_source.h"
#include "runtime/app/play_options.h"
#include "runtime/app/play_session.h"
#include "runtime/app/session_view.h"
#include "runtime/app/viewed_play.h"
#include "runtime/loop/loading.h"
#include "runtime/loop/monitor.h"
#include "runtime/loop/output.h"
#include "runtime/loop/real_time.h"

namespace palpate {
namespace {

std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free, "it is set by a signal handler");

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int signal) {
    stop_asked = true;
    if (signal == SIGTERM) end_soon(nullptr);
  };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

void warn_of_other_model(const RecordingFile& session, const Body& body) {
  if (session.info().content_hash == body.model().content_hash) return;
  print_warning("the session was recorded with another model or another precomputation of it (" +
                session.info().model_path + "): forces will differ");
}

/// Checks the outputs of the run and completes their names in the options, before anything else.
OutputPaths check_outputs(PlayOptions& options) {
  using Kind = DeviceChoice::Kind;
  OutputPaths paths(options.force);
  paths.add_input(options.file, "the model");
  if (!options.model_toml.empty()) paths.add_input(options.model_toml, "the model's description");
  if (!options.device.profile.empty()) paths.add_input(options.device.profile, "the device's profile");
  if (options.device.kind == Kind::script) paths.add_input(options.device.target, "the script");
  if (options.device.kind == Kind::replay)
    paths.add_input(options.device.target, "the session that is replayed");
  if (!options.beside.empty()) paths.add_input(options.beside, "the recording beside it");
  const auto add = [&paths](std::filesystem::path& file, OutputKind kind, const char* option) {
    if (!file.empty()) file = paths.add(file, kind, option);
  };
  add(options.record, OutputKind::recording, "--record");
  add(options.surface, OutputKind::grid, "--surface");
  add(options.contacts, OutputKind::contacts, "--contacts");
  if (options.report != standard_output) add(options.report, OutputKind::report, "--report");
  return paths;
}

int exit_code(const LoopReport& report, bool recording_failed) {
  if (recording_failed) return exit_input_error;
  if (report.interrupted) return exit_interrupted;
  return report.replay.different > 0 ? exit_differs : exit_ok;
}

}  // namespace

int play(PlayOptions options) {
  OutputPaths paths = check_outputs(options);
  std::optional<Guardian> guardian;  // forks, so it must precede the first thread
  if (options.device.kind == DeviceChoice::Kind::hid) guardian.emplace();
  stop_on_signals();
  block_acknowledging_signal();
  if (options.processor) leave_to_the_loop(*options.processor);
  std::optional<SessionView> beside;  // first: a broken file is reported even if the port is in use
  if (!options.beside.empty()) beside.emplace(options.beside);
  std::optional<ViewerPort> port;
  if (options.view) {
    ViewerOptions view = *options.view;
    view.shows = {options.file};
    if (beside) view.shows.push_back(options.beside);
    port.emplace(view);
  }
  InputSource input = make_input_source(options, guardian ? &*guardian : nullptr);
  std::unique_ptr<const Body> body =
      load_and_print(options.file, options.model_toml, options.settings.body());
  add_sources(paths, body->model(), options.file);
  if (options.session) warn_of_other_model(*options.session, *body);
  if (input.link != nullptr)
    wait_for(*input.link, options.device.kind == DeviceChoice::Kind::bridge, stop_asked);
  if (port) {
    ViewedPlay viewed(options, input, std::move(body), std::move(*port), beside ? &*beside : nullptr);
    const LoopReport report = viewed.run(stop_asked);
    return exit_code(report, viewed.recording_failed());
  }

  settle_tool(options, *body);
  tell_small_tool(too_small(options.settings.tool, *body));
  options.settings = apply_defaults(options.settings, input, *body);
  print_device(input, options.settings);
  PlaySession session(options, *body, input);
  const LoopReport& report = session.run(stop_asked);
  session.tell();
  return exit_code(report, session.recording_failure().has_value());
}

}  // namespace palpate
