#include "runtime/play.h"

#include <atomic>
#include <csignal>
#include <memory>
#include <optional>
#include <utility>

#include "meshes/error.h"
#include "runtime/act.h"
#include "runtime/loading.h"
#include "runtime/mover.h"
#include "runtime/output.h"
#include "runtime/real_time.h"
#include "runtime/viewer/viewed_play.h"

namespace palpate {
namespace {

std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free, "it is set by a signal handler");

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_asked = true; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

void warn_of_other_model(const Recording& session, const Body& body) {
  if (session.info.content_hash == body.model().content_hash) return;
  print_warning("the session was recorded with another model or another precomputation of it (" +
                session.info.model_path + "): forces will differ");
}

int exit_code(const LoopReport& report) {
  if (report.interrupted) return exit_interrupted;
  return report.replay.different > 0 ? exit_differs : exit_ok;
}

}  // namespace

int play(PlayOptions options) {
  std::optional<Guardian> guardian;  // forks, so it comes before the first thread
  if (options.device.kind == DeviceChoice::Kind::hid) guardian.emplace();
  stop_on_signals();
  if (options.processor) leave_to_the_loop(*options.processor);
  Mover mover = make_mover(options, guardian ? &*guardian : nullptr);
  std::unique_ptr<const Body> body =
      load_and_print(options.file, options.model_toml, options.settings.body());
  if (options.session) warn_of_other_model(*options.session, *body);
  if (mover.link != nullptr)
    wait_for(*mover.link, options.device.kind == DeviceChoice::Kind::bridge, stop_asked);
  if (options.view) return exit_code(ViewedPlay(options, mover, std::move(body)).run(stop_asked));

  options.settings = settle(options.settings, mover, *body);
  print_device(mover, options.settings);
  Act act(options, *body, mover);
  const LoopReport& report = act.run(stop_asked);
  act.tell();
  return exit_code(report);
}

}  // namespace palpate
